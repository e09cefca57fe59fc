"""Markers: how far they lie from the measured ones, and how fast that changes."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from solver.dynamics.trajectory.bordered_system import TrialGradient, TrialSystem
from solver.dynamics.trajectory.marker_error_levels import MarkerErrorLevels
from solver.dynamics.trajectory.spline_band import CoefficientBand
from solver.dynamics.trajectory.terms.term import REFERENCE_RATE_HZ, TrialPoint
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.kinematics.motion import Motion
from solver.skeleton.forward import ForwardKinematics, Poses, cross

# standard deviation of a single frame's error over the slow level, as if errors forgot within a hundredth
# of a second times its square: weaker, forces would pull postures away from the markers
SLOW_ERROR_FACTOR = 1.8


class SubtreeTerms:
    """The tree of one skeleton with its markers, or with other points on its bodies.

    Normal equations of weighted points, without any point's Jacobian: a point x moves with X(x) S_k by the
    axis twist S_k = (ω, v about the ground origin), X(x) = [−[x]×, 1]. What the points that two axes both
    carry add to JᵀWJ is S_kᵀ (Σ w X(x)ᵀ X(x)) S_l, and those are the points that hang on the deeper axis: six
    by six numbers an axis, as composite rigid bodies have them (Featherstone 2008, Rigid Body Dynamics
    Algorithms, section 6.2).
    """

    def __init__(
        self, kinematics: ForwardKinematics, point_bodies: Int[np.ndarray, " points"] | None = None
    ) -> None:
        """Lay out the tree.

        Args:
            kinematics: of the skeleton.
            point_bodies: index of the body under each point; None: under each marker.
        """
        chain = kinematics.chain
        pairs = list(dict.fromkeys(zip(chain.dof.tolist(), chain.body.tolist(), strict=True)))
        own: dict[int, int] = {}
        others: list[tuple[int, int]] = []
        for dof, body in pairs:
            if dof in own:
                others.append((dof, body))
            else:
                own[dof] = body
        columns = [(dof, own.get(dof, 0)) for dof in range(chain.dofs)] + others
        place = {pair: i for i, pair in enumerate(columns)}
        self.dofs, self.axes = chain.dofs, len(columns)
        self.extra_dof: Int[np.ndarray, " others"] = np.array([dof for dof, _ in others], dtype=int)
        self.column = np.array([place[p] for p in zip(chain.dof.tolist(), chain.body.tolist(), strict=True)])
        below = np.zeros((len(kinematics.skeleton.joints),) * 2, dtype=bool)  # whether a body carries another
        for body, joint in enumerate(kinematics.skeleton.joints):
            below[:, body] = below[:, joint.parent] if joint.parent >= 0 else False
            below[body, body] = True
        bodies = np.array([body for _, body in columns])
        under = kinematics.marker_bodies if point_bodies is None else point_bodies
        self.carried = below[bodies][:, under].astype(float)  # points by axis
        deeper = below[bodies][:, bodies].T.astype(float)  # [k, l]: k hangs on l, or is in the same joint
        same = bodies[:, None] == bodies
        self.at_or_below = deeper
        self.above = np.where(same, 0.0, deeper).T
        self.halved = np.where(same, 0.5, deeper)

    def twists(self, poses: Poses) -> Float[np.ndarray, "frames axes 6"]:
        """Of the axes, in the order of this tree."""
        by_position = poses.twists()
        if np.array_equal(self.column, np.arange(self.axes)):
            return by_position
        S = np.zeros((len(by_position), self.axes, 6))
        for k, column in enumerate(self.column):
            S[:, column] += by_position[:, k]
        return S

    def gradient(
        self,
        S: Float[np.ndarray, "frames axes 6"],
        x: Float[np.ndarray, "frames markers 3"],
        force: Float[np.ndarray, "frames markers 3"],
    ) -> Float[np.ndarray, "frames dofs"]:
        """Jᵀ f of forces at the markers."""
        wrench = self.carried @ np.concatenate([cross(x, force), force], axis=2)
        return self._by_dof((S * wrench).sum(axis=2))

    def same_frame(
        self,
        S: Float[np.ndarray, "frames axes 6"],
        x: Float[np.ndarray, "frames markers 3"],
        weight: Float[np.ndarray, "frames markers"],
    ) -> Float[np.ndarray, "frames dofs dofs"]:
        """Jᵀ W J, symmetric."""
        moved = (self._moments(x, x, weight) @ S[..., None])[..., 0]
        half = (moved @ S.transpose(0, 2, 1)) * self.halved
        return self._by_dofs(half + half.transpose(0, 2, 1))

    def between_frames(
        self,
        S: Float[np.ndarray, "frames axes 6"],
        x: Float[np.ndarray, "frames markers 3"],
        weight: Float[np.ndarray, "pairs markers"],
    ) -> Float[np.ndarray, "pairs dofs dofs"]:
        """J₊ᵀ W J of every frame and the one after it, J₊."""
        return self.between_pairs(S, x[1:], x[:-1], weight)

    def between_pairs(
        self,
        S: Float[np.ndarray, "frames axes 6"],
        later: Float[np.ndarray, "pairs markers 3"],
        earlier: Float[np.ndarray, "pairs markers 3"],
        weight: Float[np.ndarray, "pairs markers"],
    ) -> Float[np.ndarray, "pairs dofs dofs"]:
        """The same of points that are others in each pair of frames."""
        K = self._moments(later, earlier, weight)
        after, before = S[1:], S[:-1]
        product = (K.transpose(0, 1, 3, 2) @ after[..., None])[..., 0] @ before.transpose(0, 2, 1)
        product *= self.at_or_below
        product += (after @ (K @ before[..., None])[..., 0].transpose(0, 2, 1)) * self.above
        return self._by_dofs(product)

    def _moments(
        self,
        later: Float[np.ndarray, "some markers 3"],
        earlier: Float[np.ndarray, "some markers 3"],
        weight: Float[np.ndarray, "some markers"],
    ) -> Float[np.ndarray, "some axes 6 6"]:
        """Σ w X(later)ᵀ X(earlier) of the markers that each axis carries."""
        some, markers = weight.shape
        each = np.empty((some, markers, 16))
        each[..., 0] = weight
        each[..., 1:4] = weight[..., None] * later
        each[..., 4:7] = weight[..., None] * earlier
        each[..., 7:] = (each[..., 4:7, None] * later[..., None, :]).reshape(some, markers, 9)
        total = self.carried @ each
        K = np.zeros((some, self.axes, 6, 6))
        # −[x₊]×[x]× = (x₊·x) 1 − x x₊ᵀ
        K[..., :3, :3] = -total[..., 7:].reshape(some, self.axes, 3, 3)
        trace = total[..., 7] + total[..., 11] + total[..., 15]
        for i in range(3):
            K[..., i, i] += trace
            K[..., 3 + i, 3 + i] = total[..., 0]
            j, k = (i + 1) % 3, (i + 2) % 3
            K[..., k, 3 + j], K[..., j, 3 + k] = total[..., 1 + i], -total[..., 1 + i]
            K[..., 3 + k, j], K[..., 3 + j, k] = -total[..., 4 + i], total[..., 4 + i]
        return K

    def _by_dof(self, by_axis: Float[np.ndarray, "frames axes"]) -> Float[np.ndarray, "frames dofs"]:
        for axis, dof in enumerate(self.extra_dof, self.dofs):
            by_axis[:, dof] += by_axis[:, axis]
        return by_axis[:, : self.dofs]

    def _by_dofs(
        self, by_axes: Float[np.ndarray, "frames axes axes"]
    ) -> Float[np.ndarray, "frames dofs dofs"]:
        for axis, dof in enumerate(self.extra_dof, self.dofs):
            by_axes[:, dof] += by_axes[:, axis]
        for axis, dof in enumerate(self.extra_dof, self.dofs):
            by_axes[:, :, dof] += by_axes[:, :, axis]
        return by_axes[:, : self.dofs, : self.dofs]


class SegmentMeans:
    """The means of all segments with markers, for each pair of neighbouring frames.

    What a segment's markers say together of their changes is taken off what each says by itself. With own
    variances 1/p of the changes and a shared one c² on top, the inverse of their covariance is
    diag(p) − p pᵀ c² / (1 + c² P), P = Σ p: one more point, at the weighted mean x̄ = Σ p x / P of the
    segment's markers, of weight −c² P² / (1 + c² P). Where markers come and go, the mean is another one in
    the next pair of frames.
    """

    def __init__(
        self,
        kinematics: ForwardKinematics,
        pair_weight: Float[np.ndarray, "pairs markers"],
        shared_variance: Float[np.ndarray, " markers"],
    ) -> None:
        """Weigh them.

        Args:
            kinematics: of the skeleton with its markers.
            pair_weight: p, of each marker by itself.
            shared_variance: c² of each marker's segment, in units of 1/p.
        """
        bodies, self.segment = np.unique(kinematics.marker_bodies, return_inverse=True)
        self.of_segment = (self.segment[:, None] == np.arange(len(bodies))).astype(float)
        self.tree = SubtreeTerms(kinematics, bodies)
        total = pair_weight @ self.of_segment
        shared = shared_variance @ (self.of_segment / self.of_segment.sum(axis=0))
        self.weight = -shared * total**2 / (1 + shared * total)  # of the means
        self.share = (
            pair_weight / np.where(total > 0, total, 1.0)[:, self.segment]
        )  # of each marker in its mean

    def cost(self, change: Float[np.ndarray, "pairs markers 3"]) -> float:
        """Of the markers' changes, below zero."""
        return float((self.weight * (self._means(change) ** 2).sum(axis=2)).sum())

    def pull(self, change: Float[np.ndarray, "pairs markers 3"]) -> Float[np.ndarray, "pairs markers 3"]:
        """The gradient of half the cost by the markers' changes."""
        of_means = self.weight[:, :, None] * self._means(change)
        return self.share[:, :, None] * of_means[:, self.segment]

    def same_frame(
        self, S: Float[np.ndarray, "some axes 6"], x: Float[np.ndarray, "frames markers 3"], frames: slice
    ) -> Float[np.ndarray, "some dofs dofs"]:
        """Gauss-Newton terms at (q_t, q_t) of some frames, from the pairs before and after each of them.

        Args:
            S: the tree's twists at these frames.
            x: the markers of all frames [m].
            frames: of the trial.
        """
        H = np.zeros((len(S), self.tree.dofs, self.tree.dofs))
        later = slice(max(frames.start, 1), frames.stop)  # the second frame of a pair
        pairs = slice(later.start - 1, later.stop - 1)
        at = slice(later.start - frames.start, len(S))
        H[at] += self.tree.same_frame(S[at], self._means(x[later], pairs), self.weight[pairs])
        pairs = slice(frames.start, min(frames.stop, len(self.weight)))  # of which these are the first
        at = slice(0, pairs.stop - pairs.start)
        H[at] += self.tree.same_frame(S[at], self._means(x[pairs], pairs), self.weight[pairs])
        return H

    def between_frames(
        self, S: Float[np.ndarray, "some axes 6"], x: Float[np.ndarray, "some markers 3"], pairs: slice
    ) -> Float[np.ndarray, "pairs dofs dofs"]:
        """Gauss-Newton terms at (q_t, q_(t−1)) of neighbouring frames.

        Args:
            S: the tree's twists at these frames.
            x: the markers there [m].
            pairs: of these frames, as pairs of the trial.
        """
        later, earlier = self._means(x[1:], pairs), self._means(x[:-1], pairs)
        return self.tree.between_pairs(S, later, earlier, -self.weight[pairs])

    def _means(
        self, of_markers: Float[np.ndarray, "some markers 3"], pairs: slice = slice(None)
    ) -> Float[np.ndarray, "some segments 3"]:
        weighted = self.share[pairs][:, :, None] * of_markers
        return self.of_segment.T @ weighted


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
        self.precision = (SLOW_ERROR_FACTOR * levels.slow_m) ** -2
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
        x = _positions(at)
        errors = self._marker_errors(x)
        by_q = [self._by_q(errors, states.frames, self.tree.twists(states.poses)) for states in at.chunks]
        gradient.add_frames(at.basis, at.frame_weight * np.concatenate(by_q))
        gradient.cost += self._cost(at, x)

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
        system.gradient.cost += self._cost(at, x)

    def pulls_of_errors(
        self, at: TrialPoint, errors_ground: Iterable[Float[np.ndarray, "frames markers 3"]]
    ) -> Float[np.ndarray, "coefficients dofs errors"]:
        """Where markers that were measured so far off pull the spline, the robust weights held."""
        x = _positions(at)
        _, squares = self._errors(x)
        weight = self.seen * self.precision / (1 + squares / self.scale2)
        twists = [self.tree.twists(states.poses) for states in at.chunks]
        by_q = []
        for errors in errors_ground:
            pull = self._pull(weight, self.seen[:, :, None] * errors)
            pairs = zip(at.chunks, twists, strict=True)
            by_q.append([self.tree.gradient(S, x[s.frames], pull[s.frames]) for s, S in pairs])
        by_frame = np.stack([np.concatenate(parts) for parts in by_q], axis=2)
        flat = CoefficientBand.gather(at.basis, by_frame.reshape(len(x), -1), 0)
        return at.frame_weight * flat.reshape(len(flat), *by_frame.shape[1:])

    def _cost(self, at: TrialPoint, markers_ground: Float[np.ndarray, "frames markers 3"]) -> float:
        error, squares = self._errors(markers_ground)
        change = np.diff(error, axis=0)
        changes = (self.pair_weight * (change**2).sum(axis=2)).sum() + self.segments.cost(change)
        static = self.scale2 * (self.precision * np.log1p(squares / self.scale2)).sum()
        return at.frame_weight * float(static + changes)

    def _marker_errors(self, markers_ground: Float[np.ndarray, "frames markers 3"]) -> MarkerErrors:
        error, squares = self._errors(markers_ground)
        weight = self.seen * self.precision / (1 + squares / self.scale2)
        pull = self._pull(weight, error)
        weight[1:] += self.pair_weight
        weight[:-1] += self.pair_weight
        return MarkerErrors(markers_ground, weight, pull)

    def _pull(
        self, weight: Float[np.ndarray, "frames markers"], error: Float[np.ndarray, "frames markers 3"]
    ) -> Float[np.ndarray, "frames markers 3"]:
        """The gradient of half the cost by the markers' positions; weights are of the errors themselves."""
        change = np.diff(error, axis=0)
        change = self.pair_weight[:, :, None] * change + self.segments.pull(change)
        pull = weight[:, :, None] * error
        pull[1:] += change
        pull[:-1] -= change
        return pull

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
