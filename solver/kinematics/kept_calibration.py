"""The person's model as former trials left it, and whether the next trial agrees with it.

What a trial says of scale factors and marker offsets is one quadratic, its poses eliminated: exact in the
sense of Gauss and Newton. Trials of a person err alike, so that they share the weight that one has alone: a
further one refines the model by what it says otherwise, at the cost of one linearization. First it is asked
whether the markers are where they were, on the same person: of each marker, each segment's size and that of
the whole body, whether it is likelier near its kept place, as surely as that is known, or about its usual
one, as little as that is known of anybody.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from solver.common.notes import Note
from solver.kinematics.calibration import (
    KEPT_PRECISION,
    BorderedSolver,
    Calibration,
    CalibrationFrames,
    Evidence,
    Shared,
    SharedPrior,
)
from solver.kinematics.scale_prior import ScaleGroups
from solver.kinematics.settings import KinematicsSettings
from solver.skeleton.skeleton import Skeleton

Direction = Float[np.ndarray, "parameters some"]


@dataclass(frozen=True)
class KeptCalibration:
    """Scale factors and marker offsets, and what is known of them."""

    generic: Skeleton  # unscaled; its markers are those of the offsets
    groups: ScaleGroups
    mass_kg: float | None  # that the skeleton is given
    shared: Shared
    usual: SharedPrior  # what is known of anybody's
    lasting: Evidence  # that, and what the static trial says
    of_trials: Evidence  # in the mean
    trials: int
    notes: tuple[Note, ...]  # of matching and scaling

    @property
    def skeleton(self) -> Skeleton:
        """The scaled model."""
        return self.shared.skeleton(self.generic, self.groups, self.mass_kg)

    def refined(
        self, frames: CalibrationFrames, q: Float[np.ndarray, "frames dofs"], settings: KinematicsSettings
    ) -> "KeptCalibration | None":
        """With the evidence of a further trial; None where that speaks of other markers or another body.

        Args:
            frames: of that trial alone, their markers in the model's order.
            q: poses of the kept skeleton on them [rad or m].
            settings: of the kinematics.
        """
        said = BorderedSolver(self.generic, frames, self.groups, settings).evidence(self.shared, q)
        if self._speaks_of_others(said):
            return None
        of_trials = said.beside(self.of_trials, 1 / (self.trials + 1))
        gradient = self.lasting.gradient + of_trials.gradient
        step = -np.linalg.solve(self.lasting.precision + of_trials.precision, gradient)
        return replace(
            self,
            shared=self.shared.moved(step),
            lasting=self.lasting.seen_from(step),
            of_trials=of_trials.seen_from(step),
            trials=self.trials + 1,
        )

    def _speaks_of_others(self, said: Evidence) -> bool:
        """Whether what a trial says otherwise than the former ones is that one thing is another.

        Beforehand that is as likely as not, of whichever. How far trials of one person differ anyway is told
        by the other markers.
        """
        known = self.lasting.precision + self.of_trials.precision
        left = np.eye(len(known)) - said.precision @ np.linalg.inv(known + said.precision)
        toward, sure = -left @ (said.gradient - self.of_trials.gradient), left @ said.precision
        markers, segments = self._directions()
        seen = [m for m in markers if (m.T @ said.precision @ m).any()]
        squares = [_squared_deviations(m.T @ sure @ m, m.T @ toward) for m in seen]
        noise = [(sum(squares) - own) / (3 * (len(seen) - 1)) for own in squares]
        noise += [sum(squares) / (3 * len(seen))] * len(segments)
        usual, away = np.linalg.inv(self.usual.precision), self.usual.mean.vector - self.shared.vector
        for some, level in zip((*seen, *segments), noise, strict=True):
            along = some / np.square(some).sum(axis=0)
            likelihood = some.T @ sure @ some / level, some.T @ toward / level
            found = _log_evidence(*likelihood, along.T @ away, along.T @ usual @ along)
            if found > np.log(len(noise)):
                return True
        return False

    def _directions(self) -> tuple[list[Direction], list[Direction]]:
        """What may be another one: each marker's place; each segment's size, and that of all together."""
        each, sizes = np.eye(len(self.shared.vector)), 3 * self.groups.count
        markers = [each[:, first : first + 3] for first in range(self.groups.size, len(each), 3)]
        if self.usual.precision[0, 0] >= KEPT_PRECISION:
            return markers, []
        segments = [each[:, first : first + 3] for first in range(0, sizes, 3)]
        return markers, [*segments, each[:, :sizes].sum(axis=1, keepdims=True)]


def kept_calibration(
    calibration: Calibration, mass_kg: float | None, notes: tuple[Note, ...]
) -> KeptCalibration:
    """A calibration as the next trial of the same person may begin with it.

    Args:
        calibration: of former trials.
        mass_kg: that its skeleton was given.
        notes: of matching and scaling.
    """
    solver, shared, prior = calibration.solver, calibration.shared, calibration.prior
    moving = slice(sum(map(len, solver.frames.places)))
    alone = BorderedSolver(solver.generic, solver.frames.some(moving), solver.groups, solver.settings)
    of_trials, of_all = alone.evidence(shared, calibration.q[moving]), solver.evidence(shared, calibration.q)
    lasting = Evidence(
        of_all.gradient - of_trials.gradient + prior.precision @ (shared.vector - prior.mean.vector),
        of_all.precision - of_trials.precision + prior.precision,
    )
    return KeptCalibration(
        solver.generic,
        solver.groups,
        mass_kg,
        shared,
        prior,
        lasting,
        of_trials,
        len(solver.frames.places),
        notes,
    )


def _squared_deviations(
    precision: Float[np.ndarray, "some some"], information: Float[np.ndarray, " some"]
) -> float:
    return float(information @ np.linalg.lstsq(precision, information)[0])


def _log_evidence(
    precision: Float[np.ndarray, "some some"],
    information: Float[np.ndarray, " some"],
    mean: Float[np.ndarray, " some"],
    covariance: Float[np.ndarray, "some some"],
) -> float:
    """Logarithm of ∫ exp(ηᵀb - ½ bᵀΛb) of b that is Gaussian beforehand."""
    toward = information - precision @ mean
    system = np.eye(len(mean)) + precision @ covariance
    at_mean = information @ mean - 0.5 * mean @ precision @ mean
    gained = 0.5 * toward @ covariance @ np.linalg.solve(system, toward)
    return float(at_mean + gained - 0.5 * np.linalg.slogdet(system)[1])
