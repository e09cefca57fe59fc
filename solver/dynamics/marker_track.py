"""What a trial's markers say about a trajectory, with Gauss-Newton terms."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.dynamics.subtree_terms import SubtreeTerms
from solver.dynamics.trajectory_settings import TrajectorySettings
from solver.kinematics.motion import Motion
from solver.skeleton.forward import ForwardKinematics


@dataclass(frozen=True)
class MarkerErrors:
    """Of a whole trial at one trajectory; the gradient of half the cost by the markers' positions."""

    markers_ground: Float[np.ndarray, "frames markers 3"]  # [m]
    weight: Float[
        np.ndarray, "frames markers"
    ]  # a frame's own: of its error, and of the changes to both sides
    pull: Float[np.ndarray, "frames markers 3"]
    cost: float


class MarkerTrack:
    """Σ ρ(‖e_t‖²)/σ_m² + Σ w_t ‖e_t − e_(t−1)‖²/σ_d²: a marker that lies far off has little to say in either.

    The weights w of the changes come from the marker fit and stay.
    """

    def __init__(
        self,
        kinematics: ForwardKinematics,
        observed_ground: Float[np.ndarray, "frames markers 3"],
        start: Motion,
        settings: TrajectorySettings,
    ) -> None:
        self.tree = SubtreeTerms(kinematics)
        self.seen = np.isfinite(observed_ground).all(axis=2)
        self.observed = np.where(self.seen[:, :, None], observed_ground, 0.0)
        self.precision = settings.marker_std_m**-2
        self.scale2 = settings.marker_robust_scale_m**2
        _, squares = self._errors(kinematics.markers(kinematics.poses(start.q)))
        trust = self.seen / (1 + squares / self.scale2)
        both_seen = self.seen[1:] & self.seen[:-1]
        drift_precision = (settings.marker_drift_std_m_s / start.rate) ** -2
        self.pair_weight = drift_precision * both_seen * np.minimum(trust[1:], trust[:-1])

    def cost(self, markers_ground: Float[np.ndarray, "frames markers 3"]) -> float:
        """Both sums."""
        error, squares = self._errors(markers_ground)
        changes = self.pair_weight[:, :, None] * np.diff(error, axis=0) ** 2
        static = self.precision * self.scale2 * np.log1p(squares / self.scale2).sum()
        return float(static + changes.sum())

    def errors(self, markers_ground: Float[np.ndarray, "frames markers 3"]) -> MarkerErrors:
        """What Gauss-Newton needs of all frames; the robust weights of the errors are held."""
        error, squares = self._errors(markers_ground)
        weight = self.seen * self.precision / (1 + squares / self.scale2)
        change = self.pair_weight[:, :, None] * np.diff(error, axis=0)
        pull = weight[:, :, None] * error
        pull[1:] += change
        pull[:-1] -= change
        weight[1:] += self.pair_weight
        weight[:-1] += self.pair_weight
        return MarkerErrors(markers_ground, weight, pull, self.cost(markers_ground))

    def gradient(
        self, errors: MarkerErrors, frames: slice, S: Float[np.ndarray, "some axes 6"]
    ) -> Float[np.ndarray, "some dofs"]:
        """Of half the cost, by q of some frames.

        Args:
            errors: of the trial.
            frames: of the trial.
            S: the tree's twists at these frames.
        """
        return self.tree.gradient(S, errors.markers_ground[frames], errors.pull[frames])

    def curvature(
        self,
        errors: MarkerErrors,
        frames: slice,
        S: Float[np.ndarray, "some axes 6"],
        S_before: Float[np.ndarray, "1 axes 6"] | None,
    ) -> tuple[Float[np.ndarray, "some dofs dofs"], Float[np.ndarray, "some dofs dofs"]]:
        """Gauss-Newton terms of some frames.

        Args:
            errors: of the trial.
            frames: of the trial.
            S: the tree's twists at these frames.
            S_before: at the frame before them; None: they are the trial's first.

        Returns:
            At (q_t, q_t), and at (q_t, q_(t−1)), zero on frame 0.
        """
        x = errors.markers_ground
        H = self.tree.same_frame(S, x[frames], errors.weight[frames])
        if S_before is None:
            between = self.tree.between_frames(S, x[frames], -self.pair_weight[: frames.stop - 1])
            return H, np.concatenate([np.zeros((1, *H.shape[1:])), between])
        around, pairs = slice(frames.start - 1, frames.stop), slice(frames.start - 1, frames.stop - 1)
        S = np.concatenate([S_before, S])
        return H, self.tree.between_frames(S, x[around], -self.pair_weight[pairs])

    def _errors(
        self, x: Float[np.ndarray, "frames markers 3"]
    ) -> tuple[Float[np.ndarray, "frames markers 3"], Float[np.ndarray, "frames markers"]]:
        error = np.where(self.seen[:, :, None], x - self.observed, 0.0)
        return error, (error**2).sum(axis=2)
