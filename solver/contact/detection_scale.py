"""Two errors that last a whole trial, learnt from its own measured frames: of scale, and of the bounce."""

from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Bool, Float

from solver.contact.detection_balance import UP, Balance
from solver.contact.detection_settings import DetectionSettings

HUBER = 1.5  # standard deviations; what lies farther out weighs less
ROUNDS = 5


@dataclass(frozen=True)
class TrialErrors:
    """Missing support that is none: b · demanded + c · (demanded − weight).

    b: the entered mass is too large, or the plates show too little. c: markers on soft tissue and a trunk that
    doesn't bend exaggerate how the centre of mass bounces, by a fifth in running.
    """

    mean: Float[np.ndarray, "2"]
    covariance: Float[np.ndarray, "2 2"] = field(repr=False)

    @classmethod
    def before(cls, settings: DetectionSettings) -> "TrialErrors":
        """What is known before any frame has been weighed."""
        return cls(np.zeros(2), np.diag([settings.mass_error, settings.bounce_error]) ** 2)

    def corrected(self, balance: Balance, weight: float) -> tuple[Balance, Float[np.ndarray, " frames"]]:
        """The balance without these errors, and the standard deviation of its missing support [N]."""
        terms = _terms(balance, weight)
        force = balance.force.copy()
        force[:, UP] -= terms @ self.mean
        spread = np.einsum("ti,ij,tj->t", terms, self.covariance, terms)
        return replace(balance, force=force), np.sqrt(balance.noise**2 + spread)


def learnt_errors(
    balance: Balance,
    whole: Bool[np.ndarray, " frames"],
    *,
    weight: float,
    rate: float,
    settings: DetectionSettings,
) -> TrialErrors:
    """Bayesian regression of the missing support on frames where nothing is taken to be missing.

    Args:
        balance: as measured, without any correction.
        whole: those frames.
        weight: [N].
        rate: [Hz].
        settings: prior and noise.
    """
    before = TrialErrors.before(settings)
    if not whole.any():
        return before
    terms, noise = _terms(balance, weight)[whole], balance.noise[whole]
    missing = balance.missing[whole]
    share = 1.0 / (settings.steady_s * rate)  # of an independent observation that a frame is
    mean = before.mean
    for _ in range(ROUNDS):
        away = np.abs(missing - terms @ mean) / noise
        trust = min(1.0, share) / np.maximum(1.0, away / HUBER) / noise**2
        precision = np.linalg.inv(before.covariance) + (terms * trust[:, None]).T @ terms
        mean = np.linalg.solve(precision, (terms * trust[:, None]).T @ missing)
    limit = settings.farthest_error * np.sqrt(np.diag(before.covariance))
    return TrialErrors(np.clip(mean, -limit, limit), np.linalg.inv(precision))


def _terms(balance: Balance, weight: float) -> Float[np.ndarray, "frames 2"]:
    return np.column_stack([balance.demanded, balance.demanded - weight])
