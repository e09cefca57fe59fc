"""Weight: what mass the plates carry, together and each by itself, and what one gains as the other loses.

The mean force less what the markers' rise asks for is a weighing. A plate that reads a multiple of the true
force does so in every step: by itself it then carries another mass than was entered, or than the other plates
carry, by just that factor. Steps beside the plates leave most weighings as they are. A harness takes the same
off all of them. While somebody stands on two plates, what one gains the other loses, but for the motion's
share.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from solver.common.gravity import GRAVITY
from solver.common.plate_figures import CONTACT_N
from solver.common.statistics import log_t
from solver.common.true_runs import runs
from solver.diagnosis.direct_checks.measured import (
    EDGE_S,
    FEWEST_S,
    STANDING_S,
    STANDING_SHARE,
    WINDOW_S,
    Measured,
    may_hide,
)
from solver.diagnosis.direct_checks.statement import SOUND_DOF, About, Statement, nats_of

WEIGHT, EXCHANGE = "weight", "exchange between plates"
MASS_SCATTER = 0.024  # of the mass that forces carry about the one that laboratories state: clothes, scales
MASS_USUAL = 0.12  # loads of 8 kg; another person's mass
TRIAL_MASS_SCATTER = 0.015  # between trials of one person
PLATES_SCATTER = 0.03  # between plates, of the mass that each carries alone; legs differ
ALONE_S = 0.15  # that a plate bears alone, of a walk or a run
# of gravity, asked for on average while plates bear: forces 0.1 s late fall into flight
LEAST_ASKED_SHARE = 0.3
EXCHANGE_SCATTER = 0.05  # logarithm of what one plate gains over what the other loses
EXCHANGE_USUAL = 0.7  # likewise: half or double gain; pounds are 1.5

LEAST_SHIFT_N = 3.0  # root mean square of what goes to and fro; less is the plates' own noise


@dataclass(frozen=True)
class Exchange:
    """Between two plates of one trial, on both feet."""

    one: str  # "plate_1"
    other: str
    share: float  # newtons that the other loses for each that the one gains
    std: float

    def log_share(self, factors: Mapping[str, float]) -> float:
        """If the plates read so many times what is true."""
        return float(np.log(self.share * factors.get(self.one, 1.0) / factors.get(self.other, 1.0)))


def exchange(trials: Sequence[Measured]) -> list[Statement]:
    """Of the longest stretch of each trial in which the same two plates bear all, and no seat beside."""
    return [_said(trial, found) for trial in trials if (found := exchange_of(trial)) is not None]


def exchange_of(trial: Measured) -> Exchange | None:
    """None where nobody stands on two plates for long enough, or moves no load between them."""
    known = np.isfinite(trial.vertical_N).all(axis=1) & np.isfinite(trial.acceleration)
    sizes = np.abs(trial.vertical_N).sum(axis=1)  # of whatever sign, which is what is asked about
    if not known.any():
        return None
    with np.errstate(invalid="ignore"):
        known &= sizes > STANDING_SHARE * np.percentile(sizes[known], 90)
    with np.errstate(invalid="ignore"):
        loaded = np.abs(trial.vertical_N) > CONTACT_N
    stretch = _longest_on_two(loaded & known[:, None])
    if stretch is None or (stretch[1] - stretch[0]) / trial.rate < STANDING_S:
        return None
    start, end = stretch
    used = np.flatnonzero(loaded[start])
    one, other = trial.vertical_N[start:end, used].T
    found = _shared(one, other, trial.acceleration[start:end], trial.rate * WINDOW_S)
    return None if found is None else Exchange(f"plate_{used[0] + 1}", f"plate_{used[1] + 1}", *found)


def _said(trial: Measured, found: Exchange) -> Statement:
    share, std = found.share, found.std
    names = [trial.capture.plates[int(t.split("_")[1]) - 1].name for t in (found.one, found.other)]
    if share > 0:
        nats = nats_of(float(np.log(share)), std / share, EXCHANGE_SCATTER, EXCHANGE_USUAL)
        against_sign = nats_of(share, std, 0.3, 1.0) if share < 2 * std else -10.0
    else:
        nats, against_sign = -1.0, 0.5 * (share / std) ** 2
    return Statement(
        EXCHANGE,
        f"On both feet {names[1]} loses {share:.2f} ± {2 * std:.2f} N for each newton that {names[0]} gains "
        "(normal: 1, within 0.1).",
        {About.PLATE_SCALE: nats, About.PLATE_SIGN: min(against_sign, 50.0)},
        {"share": share, "share_std": std},
        trial=trial.capture.name,
        target=f"{found.one}+{found.other}",
    )


def _longest_on_two(loaded: Bool[np.ndarray, "frames plates"]) -> tuple[int, int] | None:
    """The longest stretch in which the same two plates are loaded, and no other."""
    found = []
    for pair in np.unique(loaded[loaded.sum(axis=1) == 2], axis=0):
        found += runs((loaded == pair).all(axis=1))
    return max(found, key=lambda run: run[1] - run[0], default=None)


def _shared(
    one: np.ndarray, other: np.ndarray, acceleration: np.ndarray, window: float
) -> tuple[float, float] | None:
    """By how much the other falls for each newton of the one, motion taken out of both; with its error.

    Both readings err, so that the slope is that of the main axis of what is left.
    """
    design = np.stack([np.ones(len(one)), acceleration], axis=1)
    both = np.stack([one, other], axis=1)
    rest = both - design @ np.linalg.lstsq(design, both, rcond=None)[0]
    sizes, axes = np.linalg.eigh(rest.T @ rest / len(rest))
    if np.sqrt(sizes[1]) < LEAST_SHIFT_N or abs(axes[0, 1]) < 1e-3:
        return None
    share = -axes[1, 1] / axes[0, 1]
    independent = max(3.0, len(one) / max(window, 1.0))
    std = (
        (1 + share**2) * np.sqrt(max(sizes[0], 0.0) * sizes[1] / independent) / max(sizes[1] - sizes[0], 1e-9)
    )
    return float(share), float(max(std, 1e-3))


LEAST_KG = 1.0  # less on a plate is nobody
ANY_FACTOR = np.geomspace(0.1, 10.0, 47)  # a twentieth apart: within what weighings scatter
NOTHING_NATS = 1e-6  # where every weighing changes alike, a mass that nobody knows takes it all in

Factors = Mapping[str, float]  # by plate, what it reads over what is true; 1 where it is missing


@dataclass(frozen=True)
class Weighing:
    """One stretch on which the same plates bear all."""

    vertical_N: Mapping[str, float]  # mean of each of these plates
    asked_m_per_s2: float  # mean of g and the upward acceleration
    trial: str = ""

    def mass_kg(self, factors: Factors) -> float:
        """That they carry, if they read so many times what is true."""
        true_N = sum(force / factors.get(plate, 1.0) for plate, force in self.vertical_N.items())
        return max(true_N / self.asked_m_per_s2, LEAST_KG)


@dataclass(frozen=True)
class Weighings:
    """All weighings of a person."""

    weighings: tuple[Weighing, ...] = ()
    exchanges: tuple[Exchange, ...] = ()
    entered_kg: float | None = None

    def for_factors(self, factors: Factors, beside: Factors) -> float:
        """How much likelier the weighings are if plates read so many times what is true [nats].

        Args:
            factors: of the plates in question.
            beside: of others, in either case.
        """
        return self._log_likelihood({**beside, **factors}) - self._log_likelihood(beside)

    def of_another_plate(self, factors: Factors, beside: Factors) -> float:
        """The most that any factor of one plate does for them, of a plate that is in neither [nats]."""
        plates = {plate for w in self.weighings for plate in w.vertical_N}
        plates |= {plate for e in self.exchanges for plate in (e.one, e.other)}
        others = sorted(plates - set(factors) - set(beside))
        tried = [self.for_factors({plate: float(f)}, beside) for plate in others for f in ANY_FACTOR]
        return max(tried, default=0.0)

    def for_lifts(
        self, lifted_N: Mapping[str, float], beside_N: Mapping[str, float], mass_kg: float
    ) -> float:
        """How much likelier the weighings are if no plate bears so much of the person [nats].

        Args:
            lifted_N: by trial.
            beside_N: in either case.
            mass_kg: of the body that is said to be there.
        """
        scatter = float(np.hypot(PLATES_SCATTER, MASS_SCATTER))

        def log_likelihood(lifts_N: Mapping[str, float]) -> float:
            bodies = [w.mass_kg({}) + lifts_N.get(w.trial, 0.0) / GRAVITY for w in self.weighings]
            away = np.log(np.maximum(bodies, LEAST_KG) / mass_kg)
            return sum(log_t(float(y), scatter, SOUND_DOF) for y in away)

        return log_likelihood(lifted_N) - log_likelihood(beside_N)

    def tell(self, factors: Factors, beside: Factors) -> bool:
        """Whether there is a mass to hold these factors against: an entered one, or other plates'."""
        return self.entered_kg is not None or abs(self.for_factors(factors, beside)) > NOTHING_NATS

    def masses_kg(self, plates: Sequence[str], factors: Factors) -> list[float]:
        """What these plates carry, each time that they bear alone."""
        own = [w for w in self.weighings if set(w.vertical_N) <= set(plates)]
        return [w.mass_kg(factors) for w in own]

    def _log_likelihood(self, factors: Factors) -> float:
        """Student's t about the entered mass, else about the mass that suits them best."""
        shares = [e.log_share(factors) for e in self.exchanges]
        stds = [np.hypot(e.std / e.share, EXCHANGE_SCATTER) for e in self.exchanges]
        of_exchanges = sum(log_t(y, float(s), SOUND_DOF) for y, s in zip(shares, stds, strict=True))
        masses = np.log([w.mass_kg(factors) for w in self.weighings])
        if not len(masses):
            return of_exchanges
        middles = masses if self.entered_kg is None else np.array([np.log(self.entered_kg)])
        scatter = float(np.hypot(PLATES_SCATTER, MASS_SCATTER))
        about = [sum(log_t(float(m - middle), scatter, SOUND_DOF) for m in masses) for middle in middles]
        return of_exchanges + max(about)


def weighings(trials: Sequence[Measured], entered_kg: float | None) -> Weighings:
    """Of all trials.

    Args:
        trials: of one person.
        entered_kg: the person's mass, if somebody entered it.
    """
    if not trials:
        return Weighings()
    found = tuple(w for trial in trials for w in _of_trial(trial))
    exchanges = tuple(e for trial in trials if (e := exchange_of(trial)) is not None and e.share > 0)
    return Weighings(found, exchanges, entered_kg)


def _of_trial(trial: Measured) -> list[Weighing]:
    """Stretches on which the same plates are loaded, without the ends where a foot may be beside them."""
    with np.errstate(invalid="ignore"):
        loaded = trial.vertical_N > CONTACT_N
    known = np.isfinite(trial.total_N + trial.acceleration)
    found = []
    least_asked = LEAST_ASKED_SHARE * GRAVITY
    for pattern in np.unique(loaded[loaded.any(axis=1)], axis=0):
        least_s = ALONE_S if pattern.sum() == 1 else 2 * EDGE_S
        for start, end in runs((loaded == pattern).all(axis=1) & known):
            first, last = _trim(trial, loaded, start, end)
            if (last - first) / trial.rate >= least_s:
                one = _weighing(trial, pattern, slice(first, last))
                found += [one] if one.asked_m_per_s2 > least_asked else []
    return found


def _trim(
    trial: Measured, loaded: Bool[np.ndarray, "frames plates"], start: int, end: int
) -> tuple[int, int]:
    edge = round(EDGE_S * trial.rate)
    return start + edge * may_hide(trial, loaded, start - 1), end - edge * may_hide(trial, loaded, end)


def _weighing(trial: Measured, pattern: Bool[np.ndarray, " plates"], span: slice) -> Weighing:
    mean = trial.vertical_N[span].mean(axis=0)
    plates = {f"plate_{k + 1}": float(mean[k]) for k in np.flatnonzero(pattern)}
    return Weighing(plates, float(GRAVITY + trial.acceleration[span].mean()), trial.capture.name)


@dataclass(frozen=True)
class Carried:
    """The mass that one trial's plates carry."""

    trial: str
    mass_kg: float
    std_kg: float  # by how the frames scatter


def carried_mass(trial: Measured) -> Carried | None:
    """Of the frames whose load is all on plates; None where there are too few."""
    return _carried_mass(trial, trial.total_N, trial.borne)


def _carried_mass(
    trial: Measured, vertical_N: Float[np.ndarray, " frames"], known: Bool[np.ndarray, " frames"]
) -> Carried | None:
    """Sum of the forces over that of g + a, which the motion's noise hardly biases.

    Nor does it scatter much: noise of positions, twice differentiated, cancels in a sum but for its ends, so
    that what is left of it falls with the time, not with its root.
    """
    seconds = float(known.sum() / trial.rate)
    if seconds < FEWEST_S:
        return None
    asked = GRAVITY + trial.acceleration[known]
    mass = carried_kg(vertical_N[known], asked)
    if mass is None:
        return None
    rest = vertical_N[known] - mass * asked
    independent = max(2.0, seconds / WINDOW_S)
    std = float(rest.std() / (independent * asked.mean()))
    return Carried(trial.capture.name, mass, std)


def carried_kg(
    vertical_N: Float[np.ndarray, " frames"], asked_m_per_s2: Float[np.ndarray, " frames"]
) -> float | None:
    """What mass these forces carry; None where they are no weighing.

    They are none where they press upwards or hardly at all, or where the motion falls while they bear: then
    forces and motion are not of one time.

    Args:
        vertical_N: upward force.
        asked_m_per_s2: g and the upward acceleration, on the same frames.
    """
    asked = float(asked_m_per_s2.mean())
    mass = float(vertical_N.mean()) / asked if asked > LEAST_ASKED_SHARE * GRAVITY else 0.0
    return mass if mass > LEAST_KG else None


def weight(trials: Sequence[Measured], entered_kg: float | None) -> list[Statement]:
    """Each trial against the mass that was entered, and trials against each other."""
    found = [carried for trial in trials if (carried := carried_mass(trial)) is not None]
    alone = [two for trial in trials if (two := _plates(trial)) is not None]
    entered = [_against_entered(one, entered_kg) for one in found if entered_kg]
    return [*entered, *_compare_trials(found, trials), *alone]


def _against_entered(one: Carried, entered_kg: float) -> Statement:
    away = float(np.log(one.mass_kg / entered_kg))
    nats = nats_of(away, one.std_kg / one.mass_kg, MASS_SCATTER, MASS_USUAL)
    return Statement(
        WEIGHT,
        f"The plates carry {one.mass_kg:.1f} ± {2 * one.std_kg:.1f} kg, and {entered_kg:.1f} kg were "
        f"entered: {100 * (one.mass_kg / entered_kg - 1):+.1f} % (normal: within 6 %).",
        {About.ENTERED_MASS: nats, About.LOAD: nats, About.PLATE_SCALE: nats},
        {"carried_kg": one.mass_kg, "carried_std_kg": one.std_kg, "entered_kg": entered_kg},
        trial=one.trial,
    )


def _compare_trials(found: Sequence[Carried], trials: Sequence[Measured]) -> list[Statement]:
    """The trial that stands off farthest from the others' middle, where there are two and more."""
    if len(found) < 2:
        return []
    said = []
    for one in found:
        others = [other for other in found if other is not one]
        usual = float(np.median([other.mass_kg for other in others]))
        away = float(np.log(one.mass_kg / usual))
        std = float(np.hypot(one.std_kg, np.median([o.std_kg for o in others])) / one.mass_kg)
        nats = nats_of(away, std, TRIAL_MASS_SCATTER, MASS_USUAL)
        said.append(
            Statement(
                WEIGHT,
                f"The plates carry {one.mass_kg:.1f} kg here and {usual:.1f} kg in the other trials "
                "(normal: within 3 %).",
                {About.LOAD: nats},
                {"carried_kg": one.mass_kg, "others_kg": usual},
                trial=one.trial,
                against=tuple(other.trial for other in others),
            )
        )
    return [max(said, key=lambda t: t.loudest)]


def _plates(trial: Measured) -> Statement | None:
    """What each plate carries while it bears alone: of the plate that stands off farthest."""
    with np.errstate(invalid="ignore"):
        loaded = trial.vertical_N > CONTACT_N
    edge = round(EDGE_S * trial.rate)
    found = {}
    for k in range(loaded.shape[1]):
        alone = loaded[:, k] & (loaded.sum(axis=1) == 1) & np.isfinite(trial.total_N + trial.acceleration)
        for start, end in runs(alone):
            alone[start : start + edge * may_hide(trial, loaded, start - 1)] = False
            alone[max(start, end - edge * may_hide(trial, loaded, end)) : end] = False
        if alone.sum() / trial.rate >= ALONE_S:
            mass = carried_kg(trial.vertical_N[alone, k], GRAVITY + trial.acceleration[alone])
            if mass is not None:
                found[k] = mass
    if len(found) < 2:
        return None
    away = {k: np.log(mass / np.median([m for j, m in found.items() if j != k])) for k, mass in found.items()}
    k = min(found, key=lambda plate: float(away[plate]))  # the lighter of two: a plate that reads too little
    nats = nats_of(float(away[k]), 0.0, PLATES_SCATTER, EXCHANGE_USUAL)
    masses = ", ".join(f"{trial.capture.plates[j].name} {mass:.1f} kg" for j, mass in found.items())
    return Statement(
        WEIGHT,
        f"While one plate bears alone, it carries: {masses} (normal: within 8 % of each other).",
        {About.PLATE_SCALE: nats, About.PLATE_ZERO: nats, About.OFF_PLATE: nats},
        {f"plate_{j + 1}_kg": mass for j, mass in found.items()},
        trial=trial.capture.name,
        target="+".join(f"plate_{j + 1}" for j in found),
    )
