"""How much force is missing under each foot: what the motion requires less what was measured."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from solver.dynamics.force_prediction.missing_wrench import wrenches_by_motion
from solver.dynamics.inverse_dynamics import counted_wrenches
from solver.fitting.fit_result import TrialFit
from solver.skeleton.skeleton import Skeleton


@dataclass(frozen=True)
class LargestMissing:
    """Where most of a range is missing."""

    frame: int
    newtons: float


@dataclass(frozen=True)
class MissingForce:
    """Sizes of the vectors [N]."""

    of_feet: Float[np.ndarray, "frames feet"]
    of_all: Float[np.ndarray, " frames"]  # of all feet together

    def largest(self, start: int, end: int, foot: int | None) -> LargestMissing | None:
        """Of frames start to end − 1; None where nothing is known of them.

        Args:
            start: first frame.
            end: the first frame after the range.
            foot: index; None: all feet together.
        """
        sizes = (self.of_all if foot is None else self.of_feet[:, foot])[start:end]
        if not np.isfinite(sizes).any():
            return None
        place = int(np.nanargmax(sizes))
        return LargestMissing(start + place, float(sizes[place]))


def missing_force(
    demand: Float[np.ndarray, "frames 3"],
    predicted: Float[np.ndarray, "frames feet 3"],
    measured: Float[np.ndarray, "frames feet 3"],
    counts: Bool[np.ndarray, "frames feet"],
) -> MissingForce:
    """Required of a foot is its predicted force where it does not count, else what the other feet leave.

    Args:
        demand: what the motion requires of all feet together [N].
        predicted: what it requires of each foot whose force does not count [N].
        measured: [N], whether it counts or not.
        counts: the fit's mask.
    """
    used = np.where(counts[:, :, None], measured, predicted)
    left = demand - used.sum(axis=1)
    vectors = np.where(counts[:, :, None], left[:, None], predicted - measured)
    return MissingForce(
        np.linalg.norm(vectors, axis=2), np.linalg.norm(demand - measured.sum(axis=1), axis=1)
    )


def predicted_wrenches(trial: TrialFit, skeleton: Skeleton) -> Float[np.ndarray, "rows feet 6"] | None:
    """What the motion requires of feet whose force is missing [N, N·m]; None where no foot's ever is.

    Args:
        trial: fitted.
        skeleton: of the fit.
    """
    if trial.dynamics is None or trial.contacts is None or trial.mask is None or trial.mask.counts.all():
        return None
    kept = trial.dynamics.wrench_predicted_ground
    return (
        kept if kept is not None else wrenches_by_motion(skeleton, trial.dynamics, trial.contacts, trial.mask)
    )


def missing_force_of(
    trial: TrialFit, predicted: Float[np.ndarray, "rows feet 6"] | None
) -> MissingForce | None:
    """Of a fitted trial, on the fit's rows; None where no foot is known, or no dynamics.

    Args:
        trial: fitted.
        predicted: by `predicted_wrenches`.
    """
    if trial.dynamics is None or trial.contacts is None or trial.mask is None:
        return None
    measured = trial.contacts.wrench_ground[:, :, :3]
    counted = counted_wrenches(trial.contacts.wrench_ground, trial.mask)[:, :, :3]
    return missing_force(
        trial.dynamics.residual_root[:, :3] + counted.sum(axis=1),
        np.zeros_like(measured) if predicted is None else predicted[:, :, :3],
        measured,
        trial.mask.counts,
    )
