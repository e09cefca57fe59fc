"""Rigid-body dynamics in the skeleton's own coordinates: Pinocchio behind the coupling map p = Φ(q)."""

from collections.abc import Sequence
from functools import cached_property

import numpy as np
import pinocchio as pin
from jaxtyping import Float, Int

from solver.skeleton.chain import Chain, Fixed, Moving, chain_of
from solver.skeleton.skeleton import Skeleton

ROOT = 0  # Pinocchio's index of the fixed world


class RigidBodyModel:
    """One skeleton as a Pinocchio model of 1-dof joints, one for each position p_k.

    Every body keeps its mass, the patellae for instance. Methods take whole trials and call Pinocchio once a
    frame. Pinocchio wants depth-first joints whatever the order of the bodies: element c of its vectors is
    p[order[c]].
    """

    def __init__(self, skeleton: Skeleton) -> None:
        self.skeleton = skeleton
        self.chain: Chain = chain_of(skeleton)
        self.model = pin.Model()
        self.model.gravity.linear = np.asarray(skeleton.gravity, dtype=float)
        self.body_joint = [ROOT] * len(skeleton.bodies)  # Pinocchio joint that carries body i
        self.body_placement = [pin.SE3.Identity()] * len(
            skeleton.bodies
        )  # body i's frame in that joint's frame
        positions: list[int] = []
        for body in _depth_first(skeleton):
            positions += self._add_body(body)
        self.order: Int[np.ndarray, " positions"] = np.array(positions, dtype=int)
        self.data = self.model.createData()

    def inverse_dynamics(
        self,
        q: Float[np.ndarray, "frames dofs"],
        v: Float[np.ndarray, "frames dofs"],
        a: Float[np.ndarray, "frames dofs"],
        wrenches_ground: Float[np.ndarray, "frames feet 6"] | None = None,
        bodies: Sequence[int] = (),
    ) -> Float[np.ndarray, "frames dofs"]:
        """Generalized forces τ = M q̈ + C(q, q̇) + g(q) − Jᵀ f.

        Args:
            q: generalized coordinates in the order of `skeleton.dofs` [rad or m].
            v: their velocities.
            a: their accelerations.
            wrenches_ground: what the surroundings do to those bodies: force [N], moment about the ground
                origin [N·m], ground frame.
            bodies: body index of each foot in `wrenches_ground`.

        Returns:
            Joint torques [N·m], or forces [N] for translations; the root's are the residual about its axes.
        """
        p, dp, ddp, slope = self._trajectory(q, v, a)
        torque = np.empty_like(p)
        for t in range(len(p)):
            if wrenches_ground is None:
                torque[t] = pin.rnea(self.model, self.data, p[t], dp[t], ddp[t])
            else:
                pin.forwardKinematics(self.model, self.data, p[t])
                forces = self._joint_forces(wrenches_ground[t], bodies)
                torque[t] = pin.rnea(self.model, self.data, p[t], dp[t], ddp[t], forces)
        return (torque * slope) @ self.selection

    def inverse_dynamics_derivatives(
        self,
        q: Float[np.ndarray, "frames dofs"],
        v: Float[np.ndarray, "frames dofs"],
        a: Float[np.ndarray, "frames dofs"],
        wrenches_ground: Float[np.ndarray, "frames feet 6"],
        bodies: Sequence[int],
    ) -> Float[np.ndarray, "frames dofs 3 dofs"]:
        """∂τ/∂(q, q̇, q̈) of the inverse dynamics; the wrenches stay where they are in the ground.

        Args:
            q: as of `inverse_dynamics`, like the others.
            v: likewise.
            a: likewise.
            wrenches_ground: likewise.
            bodies: likewise.
        """
        p, dp, ddp, slope = self._trajectory(q, v, a)
        frames, positions = p.shape
        torque = np.empty_like(p)
        by_p, by_dp, by_ddp = (np.empty((frames, positions, positions)) for _ in range(3))
        twists = np.empty((frames, 6, positions))
        for t in range(frames):
            by_p[t], by_dp[t], by_ddp[t] = pin.computeRNEADerivatives(
                self.model, self.data, p[t], dp[t], ddp[t]
            )
            torque[t], twists[t] = self.data.tau, self.data.J
        velocity, turning = twists[:, :3].transpose(0, 2, 1), twists[:, 3:].transpose(0, 2, 1)
        for k, body in enumerate(bodies):
            # S_i·w of the joints i above the foot; those j above i turn S_i by ad_{S_j} S_i
            force, moment = wrenches_ground[:, None, k, :3], wrenches_ground[:, None, k, 3:]
            above = list(self.model.supports[self.body_joint[body]])[1:]
            own = np.array([joint - 1 for joint in above], dtype=int)
            s, w = velocity[:, own], turning[:, own]
            torque[:, own] -= (s * force).sum(axis=2) + (w * moment).sum(axis=2)
            by_turning = (np.cross(s, force) + np.cross(w, moment)) @ w.transpose(0, 2, 1)
            by_moving = np.cross(w, force) @ s.transpose(0, 2, 1)
            by_p[:, own[:, None], own] -= np.tril(by_turning + by_moving, -1)
        by_states = self.by_coordinates(q, v, a, (by_p, by_dp, by_ddp))
        jacobian = self.selection.T @ np.stack([slope[:, :, None] * by for by in by_states], axis=1)
        bend = self.couple(q)[2] * torque
        jacobian[:, 0] += self.selection.T @ (bend[:, :, None] * self.selection)
        return np.ascontiguousarray(jacobian.transpose(0, 2, 1, 3))

    def centre_of_mass(self, q: Float[np.ndarray, "frames dofs"]) -> Float[np.ndarray, "frames 3"]:
        """Centre of mass of the whole body in the ground frame [m]."""
        p, _, _ = self.couple(q)
        centres = np.empty((len(p), 3))
        for t in range(len(p)):
            centres[t] = pin.centerOfMass(self.model, self.data, p[t])
        return centres

    def centre_of_mass_jacobian(
        self, q: Float[np.ndarray, "frames dofs"]
    ) -> Float[np.ndarray, "frames 3 dofs"]:
        """Its derivatives by the generalized coordinates."""
        p, slope, _ = self.couple(q)
        by_p = np.empty((len(p), 3, p.shape[1]))
        for t in range(len(p)):
            by_p[t] = pin.jacobianCenterOfMass(self.model, self.data, p[t])
        return (by_p * slope[:, None]) @ self.selection

    def centre_of_mass_acceleration(
        self,
        q: Float[np.ndarray, "frames dofs"],
        v: Float[np.ndarray, "frames dofs"],
        a: Float[np.ndarray, "frames dofs"],
    ) -> Float[np.ndarray, "frames 3"]:
        """Acceleration of the centre of mass in the ground frame [m/s²], without gravity."""
        p, dp, ddp, _ = self._trajectory(q, v, a)
        accelerations = np.empty((len(p), 3))
        for t in range(len(p)):
            pin.centerOfMass(self.model, self.data, p[t], dp[t], ddp[t])
            accelerations[t] = self.data.acom[0]
        return accelerations

    def centroidal_momentum(
        self, q: Float[np.ndarray, "frames dofs"], v: Float[np.ndarray, "frames dofs"]
    ) -> tuple[Float[np.ndarray, "frames 3"], Float[np.ndarray, "frames 3"]]:
        """Centre of mass [m], and the angular momentum about it [kg·m²/s], ground frame."""
        p, dp, _, _ = self._trajectory(q, v, np.zeros_like(v))
        centres, angular = np.empty((len(p), 3)), np.empty((len(p), 3))
        for t in range(len(p)):
            angular[t] = pin.computeCentroidalMomentum(self.model, self.data, p[t], dp[t]).angular
            centres[t] = self.data.com[0]
        return centres, angular

    def body_placements(
        self, q: Float[np.ndarray, "frames dofs"]
    ) -> tuple[Float[np.ndarray, "frames bodies 3 3"], Float[np.ndarray, "frames bodies 3"]]:
        """Orientation and origin [m] of every body in the ground frame."""
        p, _, _ = self.couple(q)
        rotations = np.empty((len(q), len(self.body_joint), 3, 3))
        origins = np.empty((len(q), len(self.body_joint), 3))
        for t in range(len(q)):
            pin.forwardKinematics(self.model, self.data, p[t])
            for i, (joint, placement) in enumerate(zip(self.body_joint, self.body_placement, strict=True)):
                body_ground = self.data.oMi[joint] * placement
                rotations[t, i], origins[t, i] = body_ground.rotation, body_ground.translation
        return rotations, origins

    # ---- building -----------------------------------------------------------------------------------------

    def _add_body(self, index: int) -> list[int]:
        """Hang a body on its parent; returns the positions p_k of the joints that were added."""
        body, parent = self.skeleton.bodies[index], self.skeleton.joints[index].parent
        joint = self.body_joint[parent] if parent >= 0 else ROOT
        placement = self.body_placement[parent] if parent >= 0 else pin.SE3.Identity()
        positions = []
        for step in self.chain.steps[index]:
            if isinstance(step, Fixed):
                placement = placement * pin.SE3(step.R, step.p)
            else:
                joint = self.model.addJoint(joint, _joint_model(step), placement, f"{body.name}_{step.index}")
                placement = pin.SE3.Identity()
                positions.append(step.index)
        self.model.appendBodyToJoint(
            joint, pin.Inertia(body.mass, body.com_body, body.inertia_body), placement
        )
        self.body_joint[index], self.body_placement[index] = joint, placement
        return positions

    # ---- the coupling map, in Pinocchio's order -----------------------------------------------------------

    def couple(
        self, q: Float[np.ndarray, "frames dofs"]
    ) -> tuple[
        Float[np.ndarray, "frames positions"],
        Float[np.ndarray, "frames positions"],
        Float[np.ndarray, "frames positions"],
    ]:
        """Φ(q) and the diagonals of Φ' and Φ'', in Pinocchio's order of the positions."""
        p, slope, curvature = self.chain.couple(q)
        return p[:, self.order], slope[:, self.order], curvature[:, self.order]

    @cached_property
    def selection(self) -> Float[np.ndarray, "positions dofs"]:
        """One where a dof drives a position, in Pinocchio's order: Φ' = diag(slope) · selection."""
        selection = np.zeros((self.chain.positions, self.chain.dofs))
        selection[np.arange(self.chain.positions), self.chain.dof[self.order]] = 1.0
        return selection

    def by_coordinates(
        self,
        q: Float[np.ndarray, "frames dofs"],
        v: Float[np.ndarray, "frames dofs"],
        a: Float[np.ndarray, "frames dofs"],
        by_positions: tuple[
            Float[np.ndarray, "frames rows positions"],
            Float[np.ndarray, "frames rows positions"],
            Float[np.ndarray, "frames rows positions"],
        ],
    ) -> tuple[
        Float[np.ndarray, "frames rows dofs"],
        Float[np.ndarray, "frames rows dofs"],
        Float[np.ndarray, "frames rows dofs"],
    ]:
        """Derivatives by q, q̇ and q̈ of what has those by p, ṗ and p̈."""
        by_p, by_dp, by_ddp = by_positions
        _, slope, curvature = self.couple(q)
        along, pulled = ((x @ self.selection.T)[:, None] for x in (v, a))
        turn, bend, third = slope[:, None], curvature[:, None], self._third_derivative(q)[:, None]
        by_q = by_p * turn + by_dp * bend * along + by_ddp * (bend * pulled + third * along**2)
        by_v = by_dp * turn + by_ddp * 2 * bend * along
        return by_q @ self.selection, by_v @ self.selection, (by_ddp * turn) @ self.selection

    def _third_derivative(
        self, q: Float[np.ndarray, "frames dofs"], step: float = 1e-4
    ) -> Float[np.ndarray, "frames positions"]:
        """The coupling map's, from differences of its second: zero but for curved functions."""
        ahead, behind = (self.couple(q + sign * step)[2] for sign in (1.0, -1.0))
        return (ahead - behind) / (2 * step)

    def _trajectory(
        self,
        q: Float[np.ndarray, "frames dofs"],
        v: Float[np.ndarray, "frames dofs"],
        a: Float[np.ndarray, "frames dofs"],
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """p, ṗ, p̈ and the diagonal of Φ', all frames × positions."""
        p, slope, curvature = self.couple(q)
        dof = self.chain.dof[self.order]
        return p, slope * v[:, dof], slope * a[:, dof] + curvature * v[:, dof] ** 2, slope

    def _joint_forces(self, wrenches: Float[np.ndarray, "feet 6"], bodies: Sequence[int]) -> pin.StdVec_Force:
        """External forces in the joints' own frames; needs the kinematics of the frame."""
        forces = pin.StdVec_Force()
        forces.extend([pin.Force.Zero()] * self.model.njoints)
        for wrench, body in zip(wrenches, bodies, strict=True):
            joint = self.body_joint[body]
            forces[joint] += self.data.oMi[joint].actInv(pin.Force(wrench))
        return forces


def _joint_model(step: Moving) -> pin.JointModel:
    if step.kind == "rotation":
        return pin.JointModelRevoluteUnaligned(step.axis)
    return pin.JointModelPrismaticUnaligned(step.axis)


def _depth_first(skeleton: Skeleton) -> list[int]:
    """Body indices, each followed by everything that hangs on it."""
    children: dict[int, list[int]] = {}
    for body, joint in enumerate(skeleton.joints):
        children.setdefault(joint.parent, []).append(body)
    order: list[int] = []
    waiting = children.get(-1, [])[::-1]
    while waiting:
        body = waiting.pop()
        order.append(body)
        waiting += children.get(body, [])[::-1]
    return order
