"""What a motion demands of the ground: the only external wrench with which F = ma holds at the root."""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from solver.skeleton.forward import cross
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.rotations import skew


@dataclass(frozen=True)
class DemandSlopes:
    """A required wrench [force, moment about the given points] and its derivatives by q, q̇ and q̈."""

    wrench: Float[np.ndarray, "times 6"]  # [N, N·m]
    by_q: Float[np.ndarray, "times 6 dofs"]
    by_v: Float[np.ndarray, "times 6 dofs"]
    by_a: Float[np.ndarray, "times 6 dofs"]


class GroundDemand:
    """Newton and Euler for the whole body: f = m c̈ − m g, and n_c = dL_c/dt about the centre of mass c."""

    def __init__(self, model: RigidBodyModel) -> None:
        self.model = model
        self.mass = model.skeleton.mass
        self.weight = -self.mass * np.asarray(model.skeleton.gravity)
        self._dof = model.chain.dof[model.order]  # that drives each of Pinocchio's positions

    def wrench(
        self,
        q: Float[np.ndarray, "times dofs"],
        v: Float[np.ndarray, "times dofs"],
        a: Float[np.ndarray, "times dofs"],
    ) -> Float[np.ndarray, "times 6"]:
        """Force [N] and moment about the ground origin [N·m], ground frame."""
        p, slope, curvature = self.model.couple(q)
        v_p, a_p = v[:, self._dof], a[:, self._dof]
        dp, ddp = slope * v_p, slope * a_p + curvature * v_p**2
        pin_model, data = self.model.model, self.model.data
        rate, com = np.empty((len(q), 6)), np.empty((len(q), 3))
        for t in range(len(q)):
            pin.computeCentroidalMomentumTimeVariation(pin_model, data, p[t], dp[t], ddp[t])
            rate[t, :3], rate[t, 3:], com[t] = data.dhg.linear, data.dhg.angular, data.com[0]
        force = rate[:, :3] + self.weight
        return np.concatenate([force, rate[:, 3:] + cross(com, force)], axis=1)

    def slopes(
        self,
        q: Float[np.ndarray, "times dofs"],
        v: Float[np.ndarray, "times dofs"],
        a: Float[np.ndarray, "times dofs"],
        about: Float[np.ndarray, "times 3"],
    ) -> DemandSlopes:
        """The wrench about points fixed in the ground frame, with its derivatives."""
        pin_model, data = self.model.model, self.model.data
        p, slope, curvature = self.model.couple(q)
        v_p, a_p = v[:, self._dof], a[:, self._dof]
        dp, ddp = slope * v_p, slope * a_p + curvature * v_p**2
        shape = (len(q), 6, p.shape[1])
        rate, by_p, by_dp, by_ddp = np.empty(shape[:2]), np.empty(shape), np.empty(shape), np.empty(shape)
        com = np.empty((len(q), 3))
        for t in range(len(q)):
            _, by_p[t], by_dp[t], by_ddp[t] = pin.computeCentroidalDynamicsDerivatives(
                pin_model, data, p[t], dp[t], ddp[t]
            )
            rate[t, :3], rate[t, 3:], com[t] = data.dhg.linear, data.dhg.angular, data.com[0]
        force = rate[:, :3] + self.weight
        arm = com - about
        wrench = np.concatenate([force, rate[:, 3:] + cross(arm, force)], axis=1)
        # the moment about a fixed point adds (c − point) × f; the centre of mass moves by d(m ċ̈)/dp̈ / m
        lever, across = skew(arm), skew(force)
        for table in (by_p, by_dp, by_ddp):
            table[:, 3:] += lever @ table[:, :3]
        by_p[:, 3:] -= across @ (by_ddp[:, :3] / self.mass)
        bending = curvature * a_p + self._third_slope(q) * v_p**2
        by_q = by_p * slope[:, None] + by_dp * (curvature * v_p)[:, None] + by_ddp * bending[:, None]
        by_v = by_dp * slope[:, None] + by_ddp * (2 * curvature * v_p)[:, None]
        by_a = by_ddp * slope[:, None]
        return DemandSlopes(wrench, *(table @ self.model.selection for table in (by_q, by_v, by_a)))

    def _third_slope(self, q: Float[np.ndarray, "times dofs"]) -> Float[np.ndarray, "times positions"]:
        """The coupling map's third derivative, by differences of the second."""
        step = 1e-5  # [rad or m]
        return (self.model.couple(q + step)[2] - self.model.couple(q - step)[2]) / (2 * step)
