"""Weighings: what mass each plate carries while all is on plates, and whether other units would suit that.

A plate that reads a multiple of the true force does so in every step: by itself it then carries another mass
than was entered, or than the other plates carry, by just that factor. Steps beside the plates leave most
weighings as they are. A harness takes the same off all of them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from solver.common.gravity import GRAVITY
from solver.common.runs import runs
from solver.common.statistics import log_t
from solver.diagnosis.direct_checks.exchange import Exchange, exchange_of
from solver.diagnosis.direct_checks.measured import Measured, may_hide
from solver.diagnosis.direct_checks.settings import DIRECT_CHECKES, DirectCheckSettings
from solver.diagnosis.direct_checks.statement import SOUND_DOF

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
    settings: DirectCheckSettings = DIRECT_CHECKES

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
        scatter = float(np.hypot(self.settings.plates_scatter, self.settings.mass_scatter))

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
        stds = [np.hypot(e.std / e.share, self.settings.exchange_scatter) for e in self.exchanges]
        of_exchanges = sum(log_t(y, float(s), SOUND_DOF) for y, s in zip(shares, stds, strict=True))
        masses = np.log([w.mass_kg(factors) for w in self.weighings])
        if not len(masses):
            return of_exchanges
        middles = masses if self.entered_kg is None else np.array([np.log(self.entered_kg)])
        scatter = float(np.hypot(self.settings.plates_scatter, self.settings.mass_scatter))
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
    return Weighings(found, exchanges, entered_kg, trials[0].settings)


def _of_trial(trial: Measured) -> list[Weighing]:
    """Stretches on which the same plates are loaded, without the ends where a foot may be beside them."""
    settings = trial.settings
    with np.errstate(invalid="ignore"):
        loaded = trial.vertical_N > settings.loaded_N
    known = np.isfinite(trial.total_N + trial.acceleration)
    found = []
    least_asked = settings.least_asked_share * GRAVITY
    for pattern in np.unique(loaded[loaded.any(axis=1)], axis=0):
        least_s = settings.alone_s if pattern.sum() == 1 else 2 * settings.edge_s
        for start, end in runs((loaded == pattern).all(axis=1) & known):
            first, last = _trimmed(trial, loaded, start, end)
            if (last - first) / trial.rate >= least_s:
                one = _weighing(trial, pattern, slice(first, last))
                found += [one] if one.asked_m_per_s2 > least_asked else []
    return found


def _trimmed(
    trial: Measured, loaded: Bool[np.ndarray, "frames plates"], start: int, end: int
) -> tuple[int, int]:
    edge = round(trial.settings.edge_s * trial.rate)
    return start + edge * may_hide(trial, loaded, start - 1), end - edge * may_hide(trial, loaded, end)


def _weighing(trial: Measured, pattern: Bool[np.ndarray, " plates"], span: slice) -> Weighing:
    mean = trial.vertical_N[span].mean(axis=0)
    plates = {f"plate_{k + 1}": float(mean[k]) for k in np.flatnonzero(pattern)}
    return Weighing(plates, float(GRAVITY + trial.acceleration[span].mean()), trial.capture.name)
