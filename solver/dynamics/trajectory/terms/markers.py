"""Markers: how far they lie from the measured ones, and how fast that changes."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.dynamics.trajectory.bordered_system import TrialGradient, TrialSystem
from solver.dynamics.trajectory.marker_error_levels import MarkerErrorLevels
from solver.dynamics.trajectory.subtree_terms import SubtreeTerms
from solver.dynamics.trajectory.terms.segment_means import SegmentMeans
from solver.dynamics.trajectory.terms.trial_point import REFERENCE_RATE_HZ, TrialPoint
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.kinematics.motion import Motion
from solver.skeleton.forward import ForwardKinematics


@dataclass(frozen=True)
class MarkerErrors:
    """Of a whole trial at one trajectory; the gradient of half the cost by the markers' positions."""

    markers_ground: Float[np.ndarray, "frames markers 3"]  # [m]
    # A frame's own: of its error, and of the changes to both sides.
    weight: Float[np.ndarray, "frames markers"]
    pull: Float[np.ndarray, "frames markers 3"]


class Markers:
    """Σ ρ(‖e_t‖²)/σ_m² + Σ Δe_tᵀ C⁻¹ Δe_t, Δe_t = e_t − e_(t−1): a marker that lies far off has little say.

    σ_m and C are the recording's own (`marker_error_levels`). Changes have covariance C = own² + shared² 11ᵀ
    within a segment. Its inverse is that of the markers by themselves less what their weighted mean tells
    twice (Sherman and Morrison), so each segment counts as one more point, the mean of its markers, of
    negative weight. Weights of changes come from the marker fit and stay.
    """

    def __init__(
        self,
        kinematics: ForwardKinematics,
        observed_ground: Float[np.ndarray, "frames markers 3"],
        start: Motion,
        settings: TrajectorySettings,
        levels: MarkerErrorLevels,
    ) -> None:
        self.tree = SubtreeTerms(kinematics)
        self.seen = np.isfinite(observed_ground).all(axis=2)
        self.observed = np.where(self.seen[:, :, None], observed_ground, 0.0)
        self.precision = (settings.slow_error_factor * levels.slow_m) ** -2
        self.scale2 = settings.marker_robust_scale_m**2
        _, squares = self._errors(kinematics.markers(kinematics.poses(start.q)))
        trust = self.seen / (1 + squares / self.scale2)
        both_seen = self.seen[1:] & self.seen[:-1]
        own = (settings.growth_factor * levels.growth_m) ** -2 * start.rate / (REFERENCE_RATE_HZ / start.rate)
        self.pair_weight = own * both_seen * np.minimum(trust[1:], trust[:-1])
        self.segments = SegmentMeans(kinematics, self.pair_weight, settings.shared_growth**2 / own)

    def cost(self, at: TrialPoint) -> float:
        """Both sums."""
        return self._cost(at, _positions(at))

    def add_gradient(self, at: TrialPoint, gradient: TrialGradient) -> None:
        """By the coefficients."""
        errors = self._marker_errors(_positions(at))
        by_q = [self._by_q(errors, states.frames, self.tree.twists(states.poses)) for states in at.chunks]
        gradient.add_frames(at.basis, at.frame_weight * np.concatenate(by_q))

    def add_linearized(self, at: TrialPoint, system: TrialSystem) -> None:
        """The robust weights of the errors are held."""
        x = _positions(at)
        errors, by_q, S_last = self._marker_errors(x), [], None
        for states in at.chunks:
            S = self.tree.twists(states.poses)
            H, H_before = self._curvature(errors, states.frames, S, S_last)
            system.band.add_frames(states.frames.start, H, H_before, at.frame_weight)
            by_q.append(self._by_q(errors, states.frames, S))
            S_last = S[-1:]
        system.gradient.add_frames(at.basis, at.frame_weight * np.concatenate(by_q))
        system.cost += self._cost(at, x)

    def _cost(self, at: TrialPoint, markers_ground: Float[np.ndarray, "frames markers 3"]) -> float:
        error, squares = self._errors(markers_ground)
        change = np.diff(error, axis=0)
        changes = (self.pair_weight * (change**2).sum(axis=2)).sum() + self.segments.cost(change)
        static = self.scale2 * (self.precision * np.log1p(squares / self.scale2)).sum()
        return at.frame_weight * float(static + changes)

    def _marker_errors(self, markers_ground: Float[np.ndarray, "frames markers 3"]) -> MarkerErrors:
        error, squares = self._errors(markers_ground)
        weight = self.seen * self.precision / (1 + squares / self.scale2)
        change = np.diff(error, axis=0)
        change = self.pair_weight[:, :, None] * change + self.segments.pull(change)
        pull = weight[:, :, None] * error
        pull[1:] += change
        pull[:-1] -= change
        weight[1:] += self.pair_weight
        weight[:-1] += self.pair_weight
        return MarkerErrors(markers_ground, weight, pull)

    def _by_q(
        self, errors: MarkerErrors, frames: slice, S: Float[np.ndarray, "some axes 6"]
    ) -> Float[np.ndarray, "some dofs"]:
        """The gradient by q of some frames, whose axes have the twists S."""
        return self.tree.gradient(S, errors.markers_ground[frames], errors.pull[frames])

    def _curvature(
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
            S: the axes' twists at these frames.
            S_before: at the frame before them; None: they are the trial's first.

        Returns:
            At (q_t, q_t), and at (q_t, q_(t−1)), zero on frame 0.
        """
        x = errors.markers_ground
        H = self.tree.same_frame(S, x[frames], errors.weight[frames])
        H += self.segments.same_frame(S, x, frames)
        around = slice(max(0, frames.start - 1), frames.stop)
        pairs = slice(around.start, frames.stop - 1)
        if S_before is not None:
            S = np.concatenate([S_before, S])
        between = self.tree.between_frames(S, x[around], -self.pair_weight[pairs])
        between += self.segments.between_frames(S, x[around], pairs)
        if S_before is None:
            between = np.concatenate([np.zeros((1, *between.shape[1:])), between])
        return H, between

    def _errors(
        self, x: Float[np.ndarray, "frames markers 3"]
    ) -> tuple[Float[np.ndarray, "frames markers 3"], Float[np.ndarray, "frames markers"]]:
        error = np.where(self.seen[:, :, None], x - self.observed, 0.0)
        return error, (error**2).sum(axis=2)


def _positions(at: TrialPoint) -> Float[np.ndarray, "frames markers 3"]:
    return np.concatenate([at.kinematics.markers(states.poses) for states in at.chunks])
