"""The root's residual at one point of a trial, linearized again and again with other frames hidden."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.dynamics.material_acceleration import material_accelerations
from solver.dynamics.root_wrench import about_point, root_centre
from solver.dynamics.trajectory.bordered_system import TrialSystem
from solver.dynamics.trajectory.terms.residual_rows import add_by_states
from solver.dynamics.trajectory.terms.root_residual import RootResidual
from solver.dynamics.trajectory.terms.trial_point import TrialPoint
from solver.kinematics.root_joint import root_joint


class BlindResidual:
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
        hidden: Bool[np.ndarray, " frames"],
        columns_ground: Float[np.ndarray, "frames 6 extra"],
    ) -> None:
        """As the residual does, without some frames, and with other columns of x; costs are of all frames.

        Args:
            system: to be added to.
            hidden: frames to leave out.
            columns_ground: force [N] and moment about the ground origin [N·m] by x; at this point x is zero
                where they differ from those that the rows were made with.
        """
        by_states = []
        for states, rows, centre in zip(self.at.chunks, self.rows, self.centres, strict=True):
            frames = states.frames
            seen = rows.with_columns(columns_ground[frames], centre).without(hidden[frames])
            seen.add_to(system, frames.start, self.at.frame_weight)
            by_states.append(seen.gradient_by_states)
        add_by_states(self.at, by_states, system.gradient)

    def missed(
        self,
        frames: Bool[np.ndarray, " frames"],
        columns_ground: Float[np.ndarray, "frames 6 extra"],
        coefficients: Sequence[Float[np.ndarray, "coefficients columns"]],
        shared: Sequence[Float[np.ndarray, " shared"]],
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
