"""The root's residual, F = ma: its rows, its term, and the same with other frames hidden."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.dynamics.inertia_parameters import required_wrench, wrench_by_parameters
from solver.dynamics.material_acceleration import material_accelerations
from solver.dynamics.momentum_terms import momentum_terms
from solver.dynamics.root_wrench import about_point, root_centre
from solver.dynamics.trajectory.bordered_system import TrialGradient, TrialSystem
from solver.dynamics.trajectory.terms.term import FrameStates, SharedParameters, TrialPoint
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory.trial_data import TrialData
from solver.kinematics.root_joint import root_joint
from solver.skeleton.forward import cross, point_jacobian
from solver.skeleton.rotations import skew

# times these two on frames whose force was predicted: from other steps and the markers, it errs by 20 to 40
# N in walking
PREDICTED_LOOSER = 2.0


@dataclass(frozen=True)
class ResidualRows:
    """Whitened residual rows [force, moment about the root joint's centre] and their derivatives."""

    value: Float[np.ndarray, "frames 6"]
    by_q: Float[np.ndarray, "frames 6 dofs"]
    by_v: Float[np.ndarray, "frames 6 dofs"]
    by_a: Float[np.ndarray, "frames 6 dofs"]
    by_shared: Float[np.ndarray, "frames 6 shared"]
    weights: Float[np.ndarray, "frames 6"]  # that whitened them [1/N, 1/(N·m)]; zero on frames of U
    cost: float

    @property
    def gradient_by_states(self) -> Float[np.ndarray, "3 frames dofs"]:
        """Of half the cost, by q, q̇ and q̈."""
        return np.stack([(self.value[:, None] @ J)[:, 0] for J in (self.by_q, self.by_v, self.by_a)])

    @property
    def gradient_by_shared(self) -> Float[np.ndarray, " shared"]:
        """Of half the cost, by the shared parameters."""
        return self.shared_rows.T @ self.value.ravel()

    @property
    def shared_rows(self) -> Float[np.ndarray, "rows shared"]:
        """Derivatives of all rows by the shared parameters."""
        return self.by_shared.reshape(self.value.size, self.by_shared.shape[2])

    def add_to(self, system: TrialSystem, first: int, weight: float) -> None:
        """What frames from this one on add to a trial's system, but for its gradient by states."""
        jacobians = self.by_q, self.by_v, self.by_a
        system.band.add_residual_rows(first, jacobians, self.by_shared, system.border, weight)
        system.corner += weight * self.shared_rows.T @ self.shared_rows
        system.gradient.shared += weight * self.gradient_by_shared
        system.gradient.cost += weight * self.cost

    def without(self, held_out: Bool[np.ndarray, " frames"]) -> "ResidualRows":
        """The same, zero on some frames; the cost stays that of all."""
        seen = ~held_out[:, None, None]
        return replace(
            self,
            value=self.value * seen[:, 0],
            by_q=self.by_q * seen,
            by_v=self.by_v * seen,
            by_a=self.by_a * seen,
            by_shared=self.by_shared * seen,
        )

    def with_columns(
        self,
        inertias: int,
        columns_ground: Float[np.ndarray, "frames 6 extra"],
        centre_ground: Float[np.ndarray, "frames 3"],
    ) -> "ResidualRows":
        """The same with other columns of x, the last of the shared parameters.

        Args:
            inertias: how many shared parameters come first.
            columns_ground: force [N] and moment about the ground origin [N·m] by x.
            centre_ground: of the root joint [m].
        """
        columns = -columns_ground
        columns[:, 3:] -= skew(centre_ground) @ columns[:, :3]
        by_shared = np.concatenate(
            [self.by_shared[:, :, :inertias], self.weights[:, :, None] * columns], axis=2
        )
        return replace(self, by_shared=by_shared)


def add_by_states(
    at: TrialPoint, by_states: list[Float[np.ndarray, "3 some dofs"]], gradient: TrialGradient
) -> None:
    """Add the rows' gradient by q, q̇ and q̈ [half the cost], of all frames in order."""
    for order, by_state in enumerate(np.concatenate(by_states, axis=1)):
        gradient.add_frames(at.basis, at.frame_weight * by_state, order)


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
            looser = np.where(data.counts, 1.0, PREDICTED_LOOSER)
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
            gradient.cost += at.frame_weight * rows.cost
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


class ResidualHeldOut:
    """Its rows are made once, whichever frames are hidden."""

    def __init__(self, residual: RootResidual, at: TrialPoint) -> None:
        """Of a trial.

        Args:
            residual: with all known frames.
            at: where.
        """
        self.at, self.measured_ground = at, residual.measured
        self.rows = [residual.rows(at.shared, states) for states in at.chunks]
        root = root_joint(at.shared.inertias.skeleton)
        self.centres = [root_centre(root, states.poses) for states in at.chunks]

    def add_linearized(
        self,
        system: TrialSystem,
        held_out: Bool[np.ndarray, " frames"],
        columns_ground: Float[np.ndarray, "frames 6 extra"],
    ) -> None:
        """As the residual does, without some frames, and with other columns of x; costs are of all frames.

        Args:
            system: to be added to.
            held_out: frames to leave out.
            columns_ground: force [N] and moment about the ground origin [N·m] by x; at this point x is zero
                where they differ from those that the rows were made with.
        """
        by_states, inertias = [], self.at.shared.free_inertias
        for states, rows, centre in zip(self.at.chunks, self.rows, self.centres, strict=True):
            frames = states.frames
            seen = rows.with_columns(inertias, columns_ground[frames], centre).without(held_out[frames])
            seen.add_to(system, frames.start, self.at.frame_weight)
            by_states.append(seen.gradient_by_states)
        add_by_states(self.at, by_states, system.gradient)

    def missed(
        self,
        frames: Bool[np.ndarray, " frames"],
        columns_ground: Float[np.ndarray, "frames 6 extra"],
        coefficients: Sequence[Float[np.ndarray, "coefficients columns"]],
        shared: Float[np.ndarray, "steps shared"],
    ) -> Float[np.ndarray, "steps some 6"]:
        """The residual after steps: force [N], moment about the root joint's centre [N·m].

        Exact in inertias and x, and in the motion for the first step; to first order in how the motions of
        other steps differ from it.

        Args:
            frames: known ones, where it is asked.
            columns_ground: as for `add_linearized`.
            coefficients: the steps of the spline.
            shared: the steps of the shared parameters.
        """
        at = np.flatnonzero(frames)
        if not len(at):
            return np.zeros((len(shared), 0, 6))
        begun, dofs = self.at, self.rows[0].by_q.shape[2]
        steps = [step[:, :dofs] for step in coefficients]
        first = begun.coefficients[:, :dofs] + steps[0]
        q, v, a = (begun.basis.evaluate(first, order)[at] for order in range(3))
        poses = begun.kinematics.poses(q)
        A, T = material_accelerations(begun.kinematics, poses, q, v, a)
        after = [begun.shared.moved(step) for step in shared]
        x = np.stack([parameters.x for parameters in after])
        ground = _required(A, T, np.stack([parameters.pseudo_inertias for parameters in after]))
        ground -= self.measured_ground[at]
        ground -= np.einsum("fij,nj->nfi", columns_ground[at], x, optimize=True)
        centre = root_centre(root_joint(begun.shared.inertias.skeleton), poses)
        apart = self._apart(at, [step - steps[0] for step in steps])
        return apart + np.stack([about_point(own, centre) for own in ground])

    def _apart(
        self, at: Int[np.ndarray, " some"], steps: Sequence[Float[np.ndarray, "coefficients dofs"]]
    ) -> Float[np.ndarray, "steps some 6"]:
        """What steps of the spline change in the residual on these frames, to first order [N, N·m]."""
        moved = [np.stack([self.at.basis.evaluate(s, order)[at] for s in steps]) for order in range(3)]
        changes = np.zeros((len(steps), len(at), 6))
        for states, rows in zip(self.at.chunks, self.rows, strict=True):
            these = slice(*np.searchsorted(at, (states.frames.start, states.frames.stop)))
            here = at[these] - states.frames.start
            for J, by in zip((rows.by_q, rows.by_v, rows.by_a), moved, strict=True):
                changes[:, these] += np.einsum("fij,nfj->nfi", J[here], by[:, these], optimize=True)
            changes[:, these] /= rows.weights[here]
        return changes


def _required(
    acceleration: Float[np.ndarray, "frames bodies 3 4"],
    T_ground_body: Float[np.ndarray, "frames bodies 4 4"],
    J: Float[np.ndarray, "steps bodies 4 4"],
) -> Float[np.ndarray, "steps frames 6"]:
    """As `required_wrench` of all bodies together, by one product of matrices for all J."""
    frames = len(acceleration)
    products = np.einsum("fbik,fbjl->fijbkl", acceleration, T_ground_body).reshape(frames * 12, -1)
    P = (products @ J.reshape(len(J), -1).T).reshape(frames, 3, 4, -1)
    moments = P[:, [2, 0, 1], [1, 2, 0]] - P[:, [1, 2, 0], [2, 0, 1]]
    return np.concatenate([P[:, :, 3], moments], axis=1).transpose(2, 0, 1)
