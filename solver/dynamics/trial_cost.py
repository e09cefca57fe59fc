"""One trial's cost in the trajectory fit: markers, forces, pull, smoothness; with Gauss-Newton terms."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from solver.dynamics.bordered_system import TrialTerms
from solver.dynamics.marker_track import MarkerErrors, MarkerTrack
from solver.dynamics.residual_track import ResidualLinearization, ResidualModel, ResidualTrack
from solver.dynamics.spline_band import CoefficientBand, nearest_spline
from solver.dynamics.spline_basis import SplineBasis, spline_basis
from solver.dynamics.trajectory_settings import TrajectorySettings
from solver.dynamics.trial_states import TrialStates
from solver.kinematics.frame_solver import root_dofs
from solver.kinematics.motion import Motion
from solver.skeleton.forward import ForwardKinematics
from solver.skeleton.skeleton import Skeleton

if TYPE_CHECKING:
    from solver.dynamics.trajectory_fit import TrialData

REFERENCE_RATE_HZ = 100.0  # the weights of single frames are stated for it
CHUNK = 128  # frames whose poses and residual rows are worked out together


def jerk_level(motion: Motion, settings: TrajectorySettings) -> Float[np.ndarray, " dofs"]:
    """RMS third derivative of each dof in the marker fit below its noise [rad/s³ or m/s³].

    Running jerks ten times as much as walking; a smoothness that fits one would bend the other.
    """
    jerk = motion.low_passed(settings.jerk_cutoff_Hz).derivative(3)
    inner = jerk[len(jerk) // 10 : len(jerk) - len(jerk) // 10]
    own = np.sqrt((inner**2).mean(axis=0))
    return np.maximum(own, settings.least_jerk_share * np.sqrt((own**2).mean()))


class TrialCost:
    """What one trial adds to the cost of the trajectory fit, by its spline's coefficients."""

    def __init__(
        self, skeleton: Skeleton, data: "TrialData", settings: TrajectorySettings, extra: int = 0
    ) -> None:
        motion = data.start
        spacing = max(1, round(settings.knot_spacing_s * motion.rate))
        self.basis: SplineBasis = spline_basis(motion.frames, motion.rate, spacing)
        self.data, self.settings = data, settings
        self.per_frame = REFERENCE_RATE_HZ / motion.rate
        self.kinematics = ForwardKinematics(skeleton)
        self.markers = MarkerTrack(self.kinematics, data.observed_ground, motion, settings)
        wrench, columns = data.wrench_ground, data.extra_columns_ground
        if data.extra_wrench_ground is not None:
            wrench = wrench + data.extra_wrench_ground
        if columns is None:
            columns = np.zeros((motion.frames, 6, extra))
        self.residuals = ResidualTrack(wrench, data.counts, settings, columns)
        root = root_dofs(skeleton)
        self.pose_precision = np.where(root, 0.0, settings.pose_std_rad**-2)
        self.jerk_weight = settings.smoothness / jerk_level(motion, settings) ** 2

    def start(self) -> Float[np.ndarray, "coefficients dofs"]:
        """The spline that the search begins with: an earlier fit's, or the one nearest to a motion."""
        if self.data.spline is not None:
            return self.data.spline
        return nearest_spline(self.basis, (self.data.initial or self.data.start).q)

    def states(self, coefficients: Float[np.ndarray, "coefficients dofs"]) -> tuple[np.ndarray, ...]:
        """q, q̇, q̈ at the frames."""
        return tuple(self.basis.evaluate(coefficients, order) for order in range(3))

    def motion(self, coefficients: Float[np.ndarray, "coefficients dofs"]) -> Motion:
        """The trajectory at the frames."""
        return replace(self.data.start, q=self.basis.evaluate(coefficients))

    def cost(self, coefficients: Float[np.ndarray, "coefficients dofs"], model: ResidualModel) -> float:
        """All terms but the priors of φ and x."""
        markers, forces, pull = [], 0.0, 0.0
        for states in self._states(coefficients):
            markers.append(self.kinematics.markers(states.poses))
            forces += self.residuals.cost(model, states)
            pull += self._pull(states)
        return self._whole_cost(coefficients, self.markers.cost(np.concatenate(markers)) + pull + forces)

    def gradient(
        self,
        coefficients: Float[np.ndarray, "coefficients dofs"],
        model: ResidualModel,
        *,
        with_inertias: bool,
    ) -> tuple[Float[np.ndarray, "coefficients dofs"], Float[np.ndarray, " shared"]]:
        """Of half the cost, by the coefficients, and by φ where it is free and x."""
        all_states, errors = self._states_and_errors(coefficients)
        shared, by_frame = np.zeros(model.shared(with_inertias=with_inertias)), []
        for states in all_states:
            S = self.markers.tree.twists(states.poses)
            rows = self.residuals.linearized(model, states, with_inertias=with_inertias)
            shared += rows.shared_gradient
            by_frame.append(self._frame_gradients(states, errors, S, rows))
        return self._whole_gradient(coefficients, by_frame), self.per_frame * shared

    def linearized(
        self,
        coefficients: Float[np.ndarray, "coefficients dofs"],
        model: ResidualModel,
        *,
        with_inertias: bool,
    ) -> TrialTerms:
        """Gauss-Newton terms."""
        all_states, errors = self._states_and_errors(coefficients)
        width, dofs = model.shared(with_inertias=with_inertias), coefficients.shape[1]
        band = CoefficientBand.empty(self.basis, dofs)
        border, corner, shared = (
            np.zeros((*coefficients.shape, width)),
            np.zeros((width, width)),
            np.zeros(width),
        )
        cost, by_frame, diagonal, S_last = errors.cost, [], np.arange(dofs), None
        for states in all_states:
            first, S = states.frames.start, self.markers.tree.twists(states.poses)
            H, H_before = self.markers.curvature(errors, states.frames, S, S_last)
            H[:, diagonal, diagonal] += self.pose_precision
            band.add_frames(first, H, H_before, self.per_frame)
            rows = self.residuals.linearized(model, states, with_inertias=with_inertias)
            jacobians = rows.by_q, rows.by_v, rows.by_a
            band.add_residual_rows(first, jacobians, rows.by_shared, border, self.per_frame)
            flat = rows.by_shared.reshape(rows.value.size, width)
            corner += self.per_frame * flat.T @ flat
            shared += self.per_frame * rows.shared_gradient
            cost += rows.cost + self._pull(states)
            by_frame.append(self._frame_gradients(states, errors, S, rows))
            S_last = S[-1:]
        band.add_jerk(self.jerk_weight)
        gradient = self._whole_gradient(coefficients, by_frame)
        return TrialTerms(band, gradient, border, corner, shared, self._whole_cost(coefficients, cost))

    def _states(self, coefficients: Float[np.ndarray, "coefficients dofs"]) -> Iterator[TrialStates]:
        """All frames, chunk by chunk, each from a piece's first frame on."""
        q, v, a = self.states(coefficients)
        chunk = max(1, CHUNK // self.basis.spacing) * self.basis.spacing
        last = max(1, (len(q) - 1) // chunk)  # the trial's last frame may be all that is left of a piece
        edges = [chunk * i for i in range(last)] + [len(q)]
        for low, high in pairwise(edges):
            at = slice(low, high)
            yield TrialStates(at, q[at], v[at], a[at], self.kinematics, self.kinematics.poses(q[at]))

    def _states_and_errors(
        self, coefficients: Float[np.ndarray, "coefficients dofs"]
    ) -> tuple[list[TrialStates], MarkerErrors]:
        states = list(self._states(coefficients))
        markers = np.concatenate([self.kinematics.markers(s.poses) for s in states])
        return states, self.markers.errors(markers)

    def _frame_gradients(
        self,
        states: TrialStates,
        errors: MarkerErrors,
        S: Float[np.ndarray, "some axes 6"],
        rows: ResidualLinearization,
    ) -> Float[np.ndarray, "3 some dofs"]:
        """By q, q̇ and q̈ of some frames."""
        by_states = np.stack([(rows.value[:, None] @ J)[:, 0] for J in (rows.by_q, rows.by_v, rows.by_a)])
        by_states[0] += self.markers.gradient(errors, states.frames, S)
        by_states[0] += self.pose_precision * (states.q - self.data.start.q[states.frames])
        return by_states

    def _pull(self, states: TrialStates) -> float:
        away = states.q - self.data.start.q[states.frames]
        return float((self.pose_precision * away**2).sum())

    def _whole_cost(self, coefficients: Float[np.ndarray, "coefficients dofs"], frames: float) -> float:
        jerk = (coefficients * self.basis.jerk_product(coefficients)).sum(axis=0)
        return float(self.per_frame * frames + (self.jerk_weight * jerk).sum())

    def _whole_gradient(
        self,
        coefficients: Float[np.ndarray, "coefficients dofs"],
        by_frame: list[Float[np.ndarray, "3 some dofs"]],
    ) -> Float[np.ndarray, "coefficients dofs"]:
        gradient = self.jerk_weight * self.basis.jerk_product(coefficients)
        for order, by_state in enumerate(np.concatenate(by_frame, axis=1)):
            gradient += self.per_frame * CoefficientBand.gather(self.basis, by_state, order)
        return gradient
