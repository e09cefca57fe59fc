"""Which way each force plate counts, and its zero level: decided together, for all plates of a recording.

A hypothesis is a sign s and a zero level z for every plate. The right one makes the loads s (reading - z)
what loads must be: feet push and do not pull; and while all contacts are on plates they add up to m (g + a),
a being the vertical acceleration of the centre of mass. Where contacts lie beside the plates, or on a chair,
the sum is anything between nothing and that. In quiet standing a is next to nothing: what one plate gains
the others lose, and that tells which plates count alike. Whether all count upwards or all downwards is then
told by weight, if no zero level is in doubt, or by motion.

No model of the body is needed: the trunk's markers stand for the centre of mass (`vertical_momentum`).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float
from scipy.special import ndtr

from solver.common.gravity import GRAVITY

# by which a sign or a zero level must be ahead: a constant reading of one plate gets 7 from what is usual
# alone, and that must not turn it
CLEAR_NATS = 8.0
USED_N = 40.0  # a plate that reads less and changes by less carried nobody: nothing tells its sign
SMOOTHING_S = 0.2  # of the smoothing that forces and accelerations share; steps last three times as long
SPACING_S = 0.1  # of the samples that count: half a window apart their errors are independent
MOST_SAMPLES = 120  # evenly spread over the recording; more would only give false certainty
NOISE_N = 4.0  # of the plates' smoothed sum: amplifiers, vibration of belts
GAIN_ERROR = 0.02  # plates weigh within 1 to 3 % of each other
# error of the trunk's acceleration in quiet standing: markers' noise, breathing
ACCELERATION_FLOOR_M_S2 = 0.1
# of its size nearby, by which it errs: two thirds of the samples of 13 fully measured walks, runs, squats
# and landings are within
ACCELERATION_SHARE = 0.15
# of the trunk's acceleration that the centre of mass makes: 0.6 in squats and landings, 0.9 in walking and
# running
TRUNK_SHARE = 0.8
TRUNK_SPREAD = 0.15  # and how much that differs between motions
TRUNK_LEAST = 0.45  # no motion that we measured leaves the centre of mass less; it never goes the other way
TRUNK_MOST = 1.1  # and none makes it move more than the trunk but by errors
ACCELERATION_UNKNOWN_M_S2 = 3.0  # size of the centre of mass's in brisk walking, where no marker tells it
TARE_N = 15.0  # what taring leaves, and ringing of filters
LEVEL_KNOWN_N = 40.0  # a zero level that is not known better is not taken off; smaller ones are a tare's rest
HELD_S = 0.05  # six numbers that a loaded plate never repeats for so long: set to zero by a program
REST_S = 0.1  # for which a plate rests at its zero level, to measure all of it
USUAL_MASS_KG = 68.0  # adults' median; it decides between extremes only
USUAL_MASS_SPREAD = 0.4  # of the logarithm: 19 of 20 people are between 31 and 149 kg
ENTERED_MASS_SPREAD = 0.08  # of an entered mass: clothes, devices, carried loads, rounding
ALL_TURNED_PRIOR = 0.1  # recordings that hold the forces on the plates: a common convention
SOME_TURNED_PRIOR = 0.02  # recordings whose plates differ in sign: a channel or corners gone wrong
UNTARED_PRIOR = 0.02  # plates that were tared under a load, or not at all
UNTARED_RANGE_N = 3000.0  # their zero levels may lie anywhere within
OUTLIER_PRIOR = 1e-3  # samples that nothing explains: glitches, a swapped marker, crosstalk


@dataclass(frozen=True)
class Explanation:
    """Signs of all plates, with the zero levels that suit them best."""

    signs: tuple[int, ...]
    zeros: tuple[float, ...]  # [N]
    evidence: float  # [nats]
    zero_stds: tuple[float, ...]  # [N]


class Hypotheses:
    """Weighs signs and zero levels of the plates of one recording."""

    def __init__(
        self,
        vertical_N: Float[np.ndarray, "samples plates"],
        acceleration: Float[np.ndarray, " samples"],
        agitation: Float[np.ndarray, " samples"],
        *,
        held_N: Sequence[float | None],
        mass_kg: float | None,
    ) -> None:
        self.readings = vertical_N
        known = np.isfinite(acceleration) & np.isfinite(agitation)
        moves = np.where(known, acceleration, 0.0)
        self.design = np.stack([np.full_like(moves, GRAVITY), moves], axis=1)  # [N/kg]
        self.demand_std = np.where(
            known,
            np.hypot(ACCELERATION_FLOOR_M_S2, ACCELERATION_SHARE * np.nan_to_num(agitation)),
            ACCELERATION_UNKNOWN_M_S2,
        )
        shifts = np.linalg.norm(vertical_N - np.median(vertical_N, axis=0), axis=1)
        noise_N = np.hypot(NOISE_N, GAIN_ERROR * shifts)
        self.mass_kg = mass_kg or USUAL_MASS_KG
        spread = ENTERED_MASS_SPREAD if mass_kg else USUAL_MASS_SPREAD
        self.mass_std = spread * self.mass_kg
        self.sum_std = np.hypot(noise_N, self.mass_kg * self.demand_std)
        self.held = np.array([held is not None for held in held_N])
        self.expected = np.array([held or 0.0 for held in held_N])

    def best(self, signs: tuple[int, ...], tared: int | None = None) -> Explanation:
        """The best zero levels for these signs, found plate by plate; plate `tared` has none."""
        zeros = self.expected.copy()
        if tared is not None:
            zeros[tared] = 0.0
        evidence, stds = (found[0] for found in self._weighed(signs, zeros[None]))
        for _ in range(2):
            before = evidence
            pulls = np.minimum(np.asarray(signs) * (self.readings - zeros), 0.0).sum(axis=0)
            for k in np.argsort(pulls, kind="stable"):
                if k == tared:
                    continue
                candidates = self._zeros_of(k, signs, zeros)
                tried = np.repeat(zeros[None], len(candidates), axis=0)
                tried[:, k] = candidates
                values, all_stds = self._weighed(signs, tried)
                leader = int(np.argmax(values))
                if values[leader] > evidence:
                    evidence, zeros, stds = values[leader], tried[leader], all_stds[leader]
            if evidence == before:
                break
        return Explanation(signs, tuple(zeros.tolist()), float(evidence), tuple(stds.tolist()))

    def _zeros_of(
        self, k: int, signs: tuple[int, ...], zeros: Float[np.ndarray, " plates"]
    ) -> Float[np.ndarray, " candidates"]:
        """Levels worth trying: none, where the reading rests, its end, what weight and the others leave."""
        if self.held[k]:
            return self.expected[[k]]
        reading, sign = self.readings[:, k], signs[k]
        loads = np.asarray(signs) * (self.readings - zeros)
        others = loads.sum(axis=1) - loads[:, k]
        weights = 1 / self.demand_std[:, None]
        slope = np.linalg.lstsq(
            np.column_stack([self.design[:, 1], np.ones(len(reading))]) * weights,
            (sign * reading + others) * weights[:, 0],
            rcond=None,
        )[0][0]
        low, high = 0.5 * self.mass_kg, 2 * self.mass_kg
        masses = np.array([self.mass_kg, np.clip(slope / TRUNK_SHARE, low, high)])
        left = reading[:, None] - sign * (GRAVITY * masses - others[:, None])
        end = np.percentile(reading, 0.5 if sign > 0 else 99.5)
        return np.array([0.0, self.expected[k], _commonest(reading), end, *np.median(left, axis=0)])

    def _weighed(
        self, signs: tuple[int, ...], zeros: Float[np.ndarray, "tried plates"]
    ) -> tuple[Float[np.ndarray, " tried"], Float[np.ndarray, "tried plates"]]:
        """Evidence [nats] of zero levels, and how well each is known [N]."""
        plates = len(signs)
        loads = np.asarray(signs) * (self.readings - zeros[:, None])
        pull = np.minimum(loads, 0.0) / TARE_N
        pulled = np.log((1 - OUTLIER_PRIOR) * np.exp(-0.5 * pull**2) + OUTLIER_PRIOR).sum(axis=(1, 2))
        fit = self._fitted(loads.sum(axis=2))
        odd = zeros != self.expected
        precision = np.zeros((len(zeros), 2 + plates))
        precision[:, 0] = 1 / self.mass_std**2
        precision[:, 1] = 1 / (TRUNK_SPREAD * fit.mass_kg) ** 2
        precision[:, 2:] = np.where(odd, 12 / UNTARED_RANGE_N**2, 1 / TARE_N**2)
        jacobian = np.concatenate(
            [self.design, np.broadcast_to(np.asarray(signs, dtype=float), self.readings.shape)], axis=1
        )
        information = np.einsum("ts,si,sj->tij", fit.whole, jacobian, jacobian)
        jacobian[:, :2] = 0.0
        information += np.einsum("ts,si,sj->tij", fit.empty, jacobian, jacobian)
        diagonal = np.arange(2 + plates)
        information[:, diagonal, diagonal] += precision
        width = 0.5 * (np.log(precision).sum(axis=1) - np.linalg.slogdet(information)[1])
        stds = np.sqrt(np.linalg.inv(information)[:, diagonal[2:], diagonal[2:]])
        beforehand = self._log_prior(signs) + np.where(
            odd.any(axis=1), np.log(UNTARED_PRIOR / (2**plates - 1)), np.log1p(-UNTARED_PRIOR)
        )
        return fit.log_likelihood + pulled + width + beforehand, stds

    def _log_prior(self, signs: tuple[int, ...]) -> float:
        turned = sum(sign < 0 for sign in signs)
        if turned == 0:
            return float(np.log1p(-ALL_TURNED_PRIOR - SOME_TURNED_PRIOR))
        if turned == len(signs):
            return float(np.log(ALL_TURNED_PRIOR))
        return float(np.log(SOME_TURNED_PRIOR / (2 ** len(signs) - 2)))

    def _fitted(self, total: Float[np.ndarray, "tried samples"]) -> "_Fit":
        """Body mass, the trunk's share and the shares of contact that make each sum likeliest."""
        low, high = 0.2 * self.mass_kg, 4 * self.mass_kg
        standing = np.clip(total / GRAVITY, low, high)
        mass = np.percentile(standing, [20, 40, 60, 80], axis=1).T
        mass = np.concatenate([mass, np.full((len(total), 1), self.mass_kg)], axis=1)
        moving = TRUNK_SHARE * mass  # [kg] per acceleration of the trunk
        shares = np.full((*mass.shape, 3), (1 - OUTLIER_PRIOR) / 3)
        for last in (False, False, False, True):
            demand = np.maximum(np.stack([mass, moving], axis=-1) @ self.design.T, 0.0)
            densities = self._densities(total[:, None], demand)
            weighed = densities * shares[..., None, :]
            likelihood = weighed.sum(axis=-1) + OUTLIER_PRIOR / UNTARED_RANGE_N
            belongs = weighed / likelihood[..., None]
            whole = belongs[..., 0] / self.sum_std**2
            if last:
                break
            to_mass = 1 / self.mass_std**2
            to_share = 1 / (TRUNK_SPREAD * mass) ** 2
            g, a = self.design.T
            gg, ga, aa = whole @ (g * g) + to_mass, whole @ (g * a), whole @ (a * a) + to_share
            right_g = (whole * total[:, None]) @ g + to_mass * self.mass_kg
            right_a = (whole * total[:, None]) @ a + to_share * TRUNK_SHARE * mass
            determinant = gg * aa - ga**2
            mass, moving = (
                np.clip((aa * right_g - ga * right_a) / determinant, low, high),
                (gg * right_a - ga * right_g) / determinant,
            )
            moving = np.clip(moving, TRUNK_LEAST * mass, TRUNK_MOST * mass)
            counts = belongs.sum(axis=-2) + 1.0
            shares = (1 - OUTLIER_PRIOR) * counts / counts.sum(axis=-1, keepdims=True)
        off_share = (moving / mass - TRUNK_SHARE) / TRUNK_SPREAD
        value = np.log(likelihood).sum(axis=-1)
        value -= 0.5 * ((mass - self.mass_kg) / self.mass_std) ** 2 + 0.5 * off_share**2
        start = np.argmax(value, axis=1)
        rows = np.arange(len(total))
        empty_N = self._empty_N()
        return _Fit(
            value[rows, start], mass[rows, start], whole[rows, start], belongs[rows, start, :, 2] / empty_N**2
        )

    def _densities(
        self,
        sum_N: Float[np.ndarray, "tried #starts samples"],
        demand: Float[np.ndarray, "tried starts samples"],
    ) -> Float[np.ndarray, "tried starts samples 3"]:
        """Of the sum, where all contacts are on plates, some or none [1/N]."""
        blurred = np.hypot(self.sum_std, TARE_N)
        within = np.maximum(demand, 4 * blurred)
        partly = (ndtr(sum_N / blurred) - ndtr((sum_N - within) / blurred)) / within
        empty = np.broadcast_to(_normal(sum_N, self._empty_N()), partly.shape)
        return np.stack([_normal(sum_N - demand, self.sum_std), partly, empty], axis=-1)

    def _empty_N(self) -> float:
        return float(TARE_N * np.sqrt(self.readings.shape[1]))


@dataclass(frozen=True)
class _Fit:
    """How well each tried sum is what a body demands; weights of what tells it [1/N²]."""

    log_likelihood: Float[np.ndarray, " tried"]
    mass_kg: Float[np.ndarray, " tried"]
    whole: Float[np.ndarray, "tried samples"]
    empty: Float[np.ndarray, "tried samples"]


def _normal(
    deviation: Float[np.ndarray, "*any"], std: float | Float[np.ndarray, "*any"]
) -> Float[np.ndarray, "*any"]:
    return np.exp(-0.5 * (deviation / std) ** 2) / (np.sqrt(2 * np.pi) * std)


def _commonest(values: Float[np.ndarray, " values"]) -> float:
    """Where readings lie densest: middle of the shortest interval that holds a fifth of them."""
    ordered = np.sort(values)
    inside = max(2, len(ordered) // 5)
    if len(ordered) <= inside:
        return float(np.median(ordered))
    start = int(np.argmin(ordered[inside:] - ordered[:-inside]))
    return float(np.median(ordered[start : start + inside + 1]))


@dataclass(frozen=True)
class PlateEvidence:
    """What a recording says of one plate: the load on the foot is sign · (reading - zero)."""

    sign: int  # of the best explanation; +1: the reading is the force on the person, -1: on the plate
    sign_nats: float  # how far it is ahead of the best one with the other sign
    zero_N: float  # what the plate reads unloaded, vertically [N]; 0 for a plate that was tared
    zero_std_N: float
    zero_nats: float  # how far that is ahead of the best explanation with the plate tared
    used: bool = True  # False: it carried nobody, and nothing can be told

    def is_turned(self) -> bool:
        """Whether its sign is wrong, clearly."""
        return self.sign < 0 and self.used and not self.is_undecided()

    def is_undecided(self) -> bool:
        """Whether it was used, but neither sign is clearly ahead.

        Nor is a turned one if it asks for a zero level that nothing else tells: on two feet that share a
        load evenly, such a level can stand for a chair.
        """
        unclear = self.sign_nats < CLEAR_NATS
        invented = self.sign < 0 and self.zero_nats > 0 and self.zero_std_N > LEVEL_KNOWN_N
        return self.used and (unclear or invented)

    def is_untared(self) -> bool:
        """Whether it has a zero level beyond what taring leaves, clearly."""
        seen_empty = self.zero_std_N == 0.0
        least_N = 0.0 if seen_empty else LEVEL_KNOWN_N
        return self.zero_nats >= CLEAR_NATS and abs(self.zero_N) > least_N

    def sentence(self) -> str:
        """The verdict in words, with how sure it is."""
        if not self.used:
            return "it carried nobody, so its sign cannot be determined"
        way = "the force on the person" if self.sign > 0 else "the force on the plate"
        if self.is_undecided():
            said = f"its sign is uncertain; {way} is more likely"
        else:
            said = f"it reads {way} ({_sure(self.sign_nats)})"
        if not self.is_untared():
            return said
        known = f"± {2 * self.zero_std_N:.0f} N; {_sure(self.zero_nats)}"
        seen = "it rests there while nobody is on it" if self.zero_std_N == 0.0 else known
        return f"{said}; unloaded it reads {self.zero_N:.0f} N ({seen})"

    def has_known_level(self) -> bool:
        """Whether the recording tells how high its zero level is."""
        return self.zero_std_N <= LEVEL_KNOWN_N


def _sure(nats: float) -> str:
    return "clearly" if nats > 2 * CLEAR_NATS else "most likely"


UNUSED = PlateEvidence(sign=1, sign_nats=0.0, zero_N=0.0, zero_std_N=np.inf, zero_nats=0.0, used=False)


def weigh_signs(
    vertical_N: Float[np.ndarray, "samples plates"],
    acceleration: Float[np.ndarray, " samples"],
    agitation: Float[np.ndarray, " samples"],
    *,
    held_N: Sequence[float | None] = (),
    said: Sequence[int | None] = (),
    mass_kg: float | None = None,
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
    """
    count = vertical_N.shape[1]
    held = list(held_N) or [None] * count
    used = np.flatnonzero(_is_used(vertical_N, held))
    evidence_by_plate = [
        replace(UNUSED, zero_N=level, zero_std_N=0.0, zero_nats=np.inf) if level else UNUSED for level in held
    ]
    if not len(used):
        return tuple(evidence_by_plate)
    recording = Hypotheses(
        vertical_N[:, used], acceleration, agitation, held_N=[held[k] for k in used], mass_kg=mass_kg
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
    vertical_N: Float[np.ndarray, "samples plates"], held_N: Sequence[float | None]
) -> Bool[np.ndarray, " plates"]:
    if not len(vertical_N):
        return np.zeros(vertical_N.shape[1], dtype=bool)
    zeros = np.array([level or 0.0 for level in held_N])
    constant = np.abs(np.median(vertical_N, axis=0) - zeros) > USED_N
    return constant | (np.ptp(vertical_N, axis=0) > USED_N)


def _choices(given: Sequence[int | None]) -> Iterator[tuple[int, ...]]:
    """Signs of all plates, with none, one, two … turned of those whose sign is not given."""
    free = [k for k, sign in enumerate(given) if sign is None]
    for number in range(len(free) + 1):
        if len(free) > 4 and 2 < number < len(free):
            continue
        for turned in combinations(free, number):
            yield tuple(sign or (-1 if k in turned else 1) for k, sign in enumerate(given))
