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

    def mass_matrix(self, q: Float[np.ndarray, "frames dofs"]) -> Float[np.ndarray, "frames dofs dofs"]:
        """Mass matrix Φ'ᵀ M_p Φ' of the generalized coordinates."""
        p, slope, _ = self.couple(q)
        mass = np.zeros((len(q), self.chain.dofs, self.chain.dofs))
        for t in range(len(q)):
            upper = np.triu(pin.crba(self.model, self.data, p[t]))
            full = upper + np.triu(upper, 1).T
            map_p_q = slope[t, :, None] * self.selection
            mass[t] = map_p_q.T @ full @ map_p_q
        return mass

    def centre_of_mass(self, q: Float[np.ndarray, "frames dofs"]) -> Float[np.ndarray, "frames 3"]:
        """Centre of mass of the whole body in the ground frame [m]."""
        p, _, _ = self.couple(q)
        centres = np.empty((len(p), 3))
        for t in range(len(p)):
            centres[t] = pin.centerOfMass(self.model, self.data, p[t])
        return centres

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
