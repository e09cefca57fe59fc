"""Which way each force plate counts, and its zero level: decided together, for all plates of a recording.

A hypothesis is a sign s and a zero level z for every plate. The right one makes the loads s (reading - z)
what loads must be: feet push and do not pull; and while all contacts are on plates they add up to m (g + a),
a being the vertical acceleration of the centre of mass. Where contacts lie beside the plates, or on a chair,
the sum is anything between nothing and that. In quiet standing a is next to nothing: what one plate gains
the others lose, and that tells which plates count alike. Whether all count upwards or all downwards is then
told by weight, if no zero level is in doubt, or by motion.

No model of the body is needed: the trunk's markers stand for the centre of mass (`vertical_momentum.py`).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.plates.plate_hypotheses import Hypotheses
from solver.capture.plates.plate_sign_settings import PLATE_SIGN, PlateSignSettings


@dataclass(frozen=True)
class PlateEvidence:
    """What a recording says of one plate: the load on the foot is sign · (reading - zero)."""

    sign: int  # of the best explanation; +1: the reading is the force on the person, -1: on the plate
    sign_nats: float  # how far it is ahead of the best one with the other sign
    zero_N: float  # what the plate reads unloaded, vertically [N]; 0 for a plate that was tared
    zero_std_N: float
    zero_nats: float  # how far that is ahead of the best explanation with the plate tared
    used: bool = True  # False: it carried nobody, and nothing can be told

    def is_turned(self, settings: PlateSignSettings = PLATE_SIGN) -> bool:
        """Whether its sign is wrong, clearly."""
        return self.sign < 0 and self.used and not self.is_undecided(settings)

    def is_undecided(self, settings: PlateSignSettings = PLATE_SIGN) -> bool:
        """Whether it was used, but neither sign is clearly ahead.

        Nor is a turned one if it asks for a zero level that nothing else tells: on two feet that share a
        load evenly, such a level can stand for a chair.
        """
        unclear = self.sign_nats < settings.clear_nats
        invented = self.sign < 0 and self.zero_nats > 0 and self.zero_std_N > settings.level_known_N
        return self.used and (unclear or invented)

    def is_untared(self, settings: PlateSignSettings = PLATE_SIGN) -> bool:
        """Whether it has a zero level beyond what taring leaves, clearly."""
        seen_empty = self.zero_std_N == 0.0
        least_N = 0.0 if seen_empty else settings.level_known_N
        return self.zero_nats >= settings.clear_nats and abs(self.zero_N) > least_N

    def sentence(self, settings: PlateSignSettings = PLATE_SIGN) -> str:
        """The verdict in words, with how sure it is."""
        if not self.used:
            return "it carried nobody, so its sign cannot be determined"
        way = "the force on the person" if self.sign > 0 else "the force on the plate"
        if self.is_undecided(settings):
            said = f"its sign is uncertain; {way} is more likely"
        else:
            said = f"it reads {way} ({_sure(self.sign_nats, settings)})"
        if not self.is_untared(settings):
            return said
        known = f"± {self.zero_std_N:.0f} N; {_sure(self.zero_nats, settings)}"
        seen = "it rests there while nobody is on it" if self.zero_std_N == 0.0 else known
        return f"{said}; unloaded it reads {self.zero_N:.0f} N ({seen})"

    def has_known_level(self, settings: PlateSignSettings = PLATE_SIGN) -> bool:
        """Whether the recording tells how high its zero level is."""
        return self.zero_std_N <= settings.level_known_N


def _sure(nats: float, settings: PlateSignSettings) -> str:
    return "clearly" if nats > 2 * settings.clear_nats else "most likely"


UNUSED = PlateEvidence(sign=1, sign_nats=0.0, zero_N=0.0, zero_std_N=np.inf, zero_nats=0.0, used=False)


def weigh_signs(
    vertical_N: Float[np.ndarray, "samples plates"],
    acceleration: Float[np.ndarray, " samples"],
    agitation: Float[np.ndarray, " samples"],
    *,
    held_N: Sequence[float | None] = (),
    said: Sequence[int | None] = (),
    mass_kg: float | None = None,
    settings: PlateSignSettings = PLATE_SIGN,
) -> tuple[PlateEvidence, ...]:
    """Compare all choices of signs, each with its best zero levels and body mass.

    With more than four used plates, only choices that turn none, one, two or all of them.

    Args:
        vertical_N: upward force as the plates read it, whichever way they count; no NaN.
        acceleration: of the person's centre of mass, upwards [m/s²]; NaN where unknown.
        agitation: its size nearby [m/s²], of which its error is a share.
        held_N: per plate, the reading that a program gave to all unloaded samples; None where none did.
        said: per plate, the sign that a person gave it; None where nobody did.
        mass_kg: as entered, if it was.
        settings: what is known beforehand.
    """
    count = vertical_N.shape[1]
    held = list(held_N) or [None] * count
    used = np.flatnonzero(_is_used(vertical_N, held, settings))
    evidence_by_plate = [
        replace(UNUSED, zero_N=level, zero_std_N=0.0, zero_nats=np.inf) if level else UNUSED for level in held
    ]
    if not len(used):
        return tuple(evidence_by_plate)
    recording = Hypotheses(
        vertical_N[:, used],
        acceleration,
        agitation,
        held_N=[held[k] for k in used],
        mass_kg=mass_kg,
        settings=settings,
    )
    given = [said[int(k)] if said else None for k in used]
    explanations = [recording.best(signs) for signs in _choices(given)]
    top = max(explanations, key=lambda one: one.evidence)
    for place, k in enumerate(used):
        others = [one.evidence for one in explanations if one.signs[place] != top.signs[place]]
        zero_nats = 0.0
        if recording.held[place]:
            zero_nats = np.inf if top.zeros[place] else 0.0
        elif top.zeros[place]:
            tared = [recording.best(one.signs, tared=place).evidence for one in explanations]
            zero_nats = max(top.evidence - max(tared), 0.0)
        evidence_by_plate[k] = PlateEvidence(
            sign=top.signs[place],
            sign_nats=float(top.evidence - max(others, default=-np.inf)),
            zero_N=top.zeros[place],
            zero_std_N=0.0 if recording.held[place] else top.zero_stds[place],
            zero_nats=float(zero_nats),
        )
    return tuple(evidence_by_plate)


def _is_used(
    vertical_N: Float[np.ndarray, "samples plates"],
    held_N: Sequence[float | None],
    settings: PlateSignSettings,
) -> Bool[np.ndarray, " plates"]:
    if not len(vertical_N):
        return np.zeros(vertical_N.shape[1], dtype=bool)
    zeros = np.array([level or 0.0 for level in held_N])
    constant = np.abs(np.median(vertical_N, axis=0) - zeros) > settings.used_N
    return constant | (np.ptp(vertical_N, axis=0) > settings.used_N)


def _choices(given: Sequence[int | None]) -> Iterator[tuple[int, ...]]:
    """Signs of all plates, with none, one, two … turned of those whose sign is not given."""
    free = [k for k, sign in enumerate(given) if sign is None]
    for number in range(len(free) + 1):
        if len(free) > 4 and 2 < number < len(free):
            continue
        for turned in combinations(free, number):
            yield tuple(sign or (-1 if k in turned else 1) for k, sign in enumerate(given))
