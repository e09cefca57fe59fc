"""Forces: the wrench at the root that the motion demands and nobody recorded."""

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.dynamics.inertia_parameters import required_wrench, wrench_by_parameters
from solver.dynamics.material_acceleration import material_accelerations
from solver.dynamics.momentum_terms import momentum_terms
from solver.dynamics.root_wrench import root_centre
from solver.dynamics.trajectory.bordered_system import TrialGradient, TrialSystem
from solver.dynamics.trajectory.terms.residual_rows import ResidualRows, add_by_states
from solver.dynamics.trajectory.terms.shared_parameters import SharedParameters
from solver.dynamics.trajectory.terms.trial_point import FrameStates, TrialPoint
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory.trial_data import TrialData
from solver.kinematics.root_joint import root_joint
from solver.skeleton.forward import cross, point_jacobian
from solver.skeleton.rotations import skew


class RootResidual:
    """Σ_{t ∉ U} ρ(‖r_t‖²/σ_r²): external wrench required by the motion less what is known to act.

    That is wrench + columns x, with x shared by trials. Where the wrench on frames of U was predicted, they
    take part with a larger σ_r. ρ is Cauchy's: a frame whose force is plainly
    missing, though nobody said so, does not bend the body.
    """

    def __init__(self, data: TrialData, settings: TrajectorySettings, extra: int = 0) -> None:
        """Of a trial.

        Args:
            data: of the trial.
            settings: deviations of the residual.
            extra: parameters x that trials share; where the trial has no columns for them, they do nothing.
        """
        self.counts: Bool[np.ndarray, " frames"] = data.counts
        self.measured, columns = data.wrench_ground, data.extra_columns_ground
        looser = np.ones(len(data.counts))
        if data.predicted_ground is not None:
            self.measured = np.where(data.counts[:, None], self.measured, data.predicted_ground)
            looser = np.where(data.counts, 1.0, settings.predicted_looser)
            self.counts = np.ones(len(data.counts), dtype=bool)
        if data.extra_wrench_ground is not None:
            self.measured = self.measured + data.extra_wrench_ground
        self.columns: Float[np.ndarray, "frames 6 extra"] = (
            np.zeros((len(data.counts), 6, extra)) if columns is None else columns
        )
        scale = (settings.residual_force_std_N, settings.residual_moment_std_Nm)
        self.whitening: Float[np.ndarray, "frames 6"] = 1.0 / np.outer(looser, np.repeat(scale, 3))
        self.robust2 = settings.residual_robust_scale**2

    def cost(self, at: TrialPoint) -> float:
        """The sum."""
        return at.frame_weight * sum(self._cost(at.shared, states) for states in at.chunks)

    def add_gradient(self, at: TrialPoint, gradient: TrialGradient) -> None:
        """By the coefficients and the shared parameters."""
        by_states = []
        for states in at.chunks:
            rows = self.rows(at.shared, states)
            gradient.shared += at.frame_weight * rows.gradient_by_shared
            by_states.append(rows.gradient_by_states)
        add_by_states(at, by_states, gradient)

    def add_linearized(self, at: TrialPoint, system: TrialSystem) -> None:
        """The robust weights are held."""
        by_states, weight = [], at.frame_weight
        for states in at.chunks:
            rows = self.rows(at.shared, states)
            rows.add_to(system, states.frames.start, weight)
            by_states.append(rows.gradient_by_states)
        add_by_states(at, by_states, system.gradient)

    def _cost(self, shared: SharedParameters, states: FrameStates) -> float:
        at, states = self._known(states)
        if not len(at):
            return 0.0
        poses = states.poses
        A, T = material_accelerations(states.kinematics, poses, states.q, states.v, states.a)
        wrench = required_wrench(A, T, shared.pseudo_inertias).sum(axis=1)
        wrench -= self.measured[at] + self.columns[at] @ shared.x
        centre = root_centre(root_joint(shared.inertias.skeleton), poses)
        wrench[:, 3:] -= cross(centre, wrench[:, :3])
        return self._robust(((self.whitening[at] * wrench) ** 2).sum(axis=1))

    def rows(self, shared: SharedParameters, states: FrameStates) -> ResidualRows:
        """Of some frames; zero on those of U."""
        at, known = self._known(states)
        rows = self._rows(shared, at, known)
        if len(at) == len(states.q):
            return rows
        here = at - states.frames.start

        def padded(part: np.ndarray) -> np.ndarray:
            whole = np.zeros((len(states.q), *part.shape[1:]))
            whole[here] = part
            return whole

        return ResidualRows(
            value=padded(rows.value),
            by_q=padded(rows.by_q),
            by_v=padded(rows.by_v),
            by_a=padded(rows.by_a),
            by_shared=padded(rows.by_shared),
            weights=padded(rows.weights),
            cost=rows.cost,
        )

    def _known(self, states: FrameStates) -> tuple[Int[np.ndarray, " known"], FrameStates]:
        """Which of these frames count, as frames of the trial, and their states."""
        here = np.flatnonzero(self.counts[states.frames])
        return here + states.frames.start, states.only(here)

    def _robust(self, squares: Float[np.ndarray, " some"]) -> float:
        return float(self.robust2 * np.log1p(squares / self.robust2).sum())

    def _rows(
        self, shared: SharedParameters, at: Int[np.ndarray, " some"], states: FrameStates
    ) -> ResidualRows:
        """Whitened residuals of some frames that count, and their derivatives by q, q̇, q̈, φ and x."""
        columns = self.columns[at]
        kinematics, poses = states.kinematics, states.poses
        q, v, a = states.q, states.v, states.a
        terms = momentum_terms(shared.rigid_bodies, q, v, a, self.measured[at] + columns @ shared.x)
        root = root_joint(shared.inertias.skeleton)
        centre = root_centre(root, poses)
        centre_by_q = point_jacobian(kinematics, poses, root.body, centre)
        com_by_q = terms.by_a[:, :3] / shared.skeleton.mass
        arm, force = skew(terms.com_ground - centre), terms.residual[:, :3]
        value = terms.residual.copy()
        value[:, 3:] += (arm @ force[:, :, None])[:, :, 0]
        for rows in (terms.by_q, terms.by_v, terms.by_a):
            rows[:, 3:] += arm @ rows[:, :3]
        terms.by_q[:, 3:] -= skew(force) @ (com_by_q - centre_by_q)
        by_phi = np.zeros((len(q), 6, shared.free_inertias))
        if shared.free_inertias:
            A, T = material_accelerations(kinematics, poses, q, v, a)
            by_phi = wrench_by_parameters(A, T, shared.inertias, shared.by_phi)
        by_shared = np.concatenate([by_phi, -columns], axis=2)
        by_shared[:, 3:] -= skew(centre) @ by_shared[:, :3]
        whitening = self.whitening[at]
        squares = ((whitening * value) ** 2).sum(axis=1)
        weights = whitening / np.sqrt(1 + squares / self.robust2)[:, None]
        for derivative in (terms.by_q, terms.by_v, terms.by_a, by_shared):
            np.multiply(derivative, weights[:, :, None], out=derivative)
        return ResidualRows(
            weights * value, terms.by_q, terms.by_v, terms.by_a, by_shared, weights, self._robust(squares)
        )
