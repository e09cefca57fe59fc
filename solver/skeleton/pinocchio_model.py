"""Rigid-body dynamics in the skeleton's own coordinates: Pinocchio behind the coupling map p = Φ(q)."""

from collections.abc import Sequence
from functools import cached_property

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from solver.skeleton.chain import Chain, Fixed, Moving, chain_of
from solver.skeleton.skeleton import Body, Skeleton

ROOT = 0  # Pinocchio's index of the fixed world


class RigidBodyModel:
    """One skeleton as a Pinocchio model of 1-dof joints, one for each position p_k.

    Every body keeps its mass, massless or coupled ones (the patellae) included. Methods take whole trials and
    call Pinocchio once a frame.
    """

    def __init__(self, skeleton: Skeleton) -> None:
        self.skeleton = skeleton
        self.chain: Chain = chain_of(skeleton)
        self.model = pin.Model()
        self.model.gravity.linear = np.asarray(skeleton.gravity, dtype=float)
        self.body_joint: list[int] = []  # Pinocchio joint that carries body i
        self.body_placement: list[pin.SE3] = []  # body i's frame in that joint's frame
        for body, steps, joint in zip(skeleton.bodies, self.chain.steps, skeleton.joints, strict=True):
            self._add_body(body, steps, joint.parent)
        self.data = self.model.createData()
        # Pinocchio numbers its joints in the order in which they are added, which is that of p.
        assert self.model.nv == self.chain.positions

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
        p, dp, ddp, slope = self._positions(q, v, a)
        if wrenches_ground is None or len(bodies) == 0:
            torque = np.stack([pin.rnea(self.model, self.data, *row) for row in zip(p, dp, ddp, strict=True)])
            return self._projected(torque, slope)
        torque = np.empty_like(p)
        for t in range(len(p)):
            pin.forwardKinematics(self.model, self.data, p[t])
            forces = self._joint_forces(wrenches_ground[t], bodies)
            torque[t] = pin.rnea(self.model, self.data, p[t], dp[t], ddp[t], forces)
        return self._projected(torque, slope)

    def mass_matrix(self, q: Float[np.ndarray, "frames dofs"]) -> Float[np.ndarray, "frames dofs dofs"]:
        """Mass matrix Φ'ᵀ M_p Φ' of the generalized coordinates."""
        p, slope, _ = self.chain.couple(q)
        mass = np.zeros((len(q), self.chain.dofs, self.chain.dofs))
        for t in range(len(q)):
            upper = np.triu(pin.crba(self.model, self.data, p[t]))
            full = upper + np.triu(upper, 1).T
            map_p_q = self._slope_matrix(slope[t])
            mass[t] = map_p_q.T @ full @ map_p_q
        return mass

    def centre_of_mass(self, q: Float[np.ndarray, "frames dofs"]) -> Float[np.ndarray, "frames 3"]:
        """Centre of mass of the whole body in the ground frame [m]."""
        p, _, _ = self.chain.couple(q)
        return np.stack([pin.centerOfMass(self.model, self.data, row).copy() for row in p])

    def centre_of_mass_acceleration(
        self,
        q: Float[np.ndarray, "frames dofs"],
        v: Float[np.ndarray, "frames dofs"],
        a: Float[np.ndarray, "frames dofs"],
    ) -> Float[np.ndarray, "frames 3"]:
        """Acceleration of the centre of mass in the ground frame [m/s²], without gravity."""
        p, dp, ddp, _ = self._positions(q, v, a)
        accelerations = np.empty((len(p), 3))
        for t in range(len(p)):
            pin.centerOfMass(self.model, self.data, p[t], dp[t], ddp[t])
            accelerations[t] = self.data.acom[0]
        return accelerations

    def body_placements(
        self, q: Float[np.ndarray, "frames dofs"]
    ) -> tuple[Float[np.ndarray, "frames bodies 3 3"], Float[np.ndarray, "frames bodies 3"]]:
        """Orientation and origin [m] of every body in the ground frame."""
        p, _, _ = self.chain.couple(q)
        rotations = np.empty((len(q), len(self.body_joint), 3, 3))
        origins = np.empty((len(q), len(self.body_joint), 3))
        for t in range(len(q)):
            pin.forwardKinematics(self.model, self.data, p[t])
            for i, (joint, placement) in enumerate(zip(self.body_joint, self.body_placement, strict=True)):
                body_ground = self.data.oMi[joint] * placement
                rotations[t, i], origins[t, i] = body_ground.rotation, body_ground.translation
        return rotations, origins

    # ---- building -----------------------------------------------------------------------------------------

    def _add_body(self, body: Body, steps: tuple[Fixed | Moving, ...], parent: int) -> None:
        joint = self.body_joint[parent] if parent >= 0 else ROOT
        placement = self.body_placement[parent] if parent >= 0 else pin.SE3.Identity()
        for step in steps:
            if isinstance(step, Fixed):
                placement = placement * pin.SE3(step.R, step.p)
            else:
                joint = self.model.addJoint(joint, _joint_model(step), placement, f"{body.name}_{step.index}")
                placement = pin.SE3.Identity()
        self.model.appendBodyToJoint(joint, pin.Inertia(body.mass, body.com_body, body.inertia_body), placement)
        self.body_joint.append(joint)
        self.body_placement.append(placement)

    # ---- the coupling map -----------------------------------------------------------------------------------

    def _positions(
        self,
        q: Float[np.ndarray, "frames dofs"],
        v: Float[np.ndarray, "frames dofs"],
        a: Float[np.ndarray, "frames dofs"],
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """p, ṗ, p̈ and the diagonal of Φ', all frames × positions."""
        p, slope, curvature = self.chain.couple(q)
        v_p, a_p = v[:, self.chain.dof], a[:, self.chain.dof]
        return p, slope * v_p, slope * a_p + curvature * v_p**2, slope

    def _projected(
        self, torque: Float[np.ndarray, "frames positions"], slope: Float[np.ndarray, "frames positions"]
    ) -> Float[np.ndarray, "frames dofs"]:
        """Φ'ᵀ τ_p."""
        return (torque * slope) @ self._selection

    @cached_property
    def _selection(self) -> Float[np.ndarray, "positions dofs"]:
        selection = np.zeros((self.chain.positions, self.chain.dofs))
        selection[np.arange(self.chain.positions), self.chain.dof] = 1.0
        return selection

    def _slope_matrix(self, slope: Float[np.ndarray, " positions"]) -> Float[np.ndarray, "positions dofs"]:
        return slope[:, None] * self._selection

    def _joint_forces(
        self, wrenches: Float[np.ndarray, "feet 6"], bodies: Sequence[int]
    ) -> pin.StdVec_Force:
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
