"""The external wrench that the motion demands, about the centre of mass, and its derivatives.

By Newton and Euler it is the rate of the whole body's momentum less gravity. One Pinocchio call a frame gives
that rate and its derivatives in p, ṗ, p̈; the coupling map p = Φ(q) takes them to q, q̇, q̈.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from jaxtyping import Float

from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.rotations import skew


@dataclass(frozen=True)
class MomentumTerms:
    """Residual wrench [force, moment about the centre of mass], required less measured, ground frame."""

    residual: Float[np.ndarray, "frames 6"]  # [N], [N·m]
    by_q: Float[np.ndarray, "frames 6 dofs"]
    by_v: Float[np.ndarray, "frames 6 dofs"]
    by_a: Float[np.ndarray, "frames 6 dofs"]
    com_ground: Float[np.ndarray, "frames 3"]  # [m]


def momentum_terms(
    model: RigidBodyModel,
    q: Float[np.ndarray, "frames dofs"],
    v: Float[np.ndarray, "frames dofs"],
    a: Float[np.ndarray, "frames dofs"],
    measured_ground: Float[np.ndarray, "frames 6"],
) -> MomentumTerms:
    """Residual wrench of every frame with its derivatives.

    Args:
        model: of the skeleton.
        q: generalized coordinates [rad or m].
        v: their velocities.
        a: their accelerations.
        measured_ground: sum over the feet of force [N] and moment about the ground origin [N·m].
    """
    p, slope, curvature = model.couple(q)
    selection = model.selection
    dp = slope * (v @ selection.T)
    ddp = slope * (a @ selection.T) + curvature * (v @ selection.T) ** 2
    weight = model.skeleton.mass * model.skeleton.gravity
    frames, positions = p.shape
    rate, com = np.empty((frames, 6)), np.empty((frames, 3))
    by_p, by_dp, by_ddp = (np.empty((frames, 6, positions)) for _ in range(3))
    for t in range(frames):
        _, by_p[t], by_dp[t], by_ddp[t] = pin.computeCentroidalDynamicsDerivatives(
            model.model, model.data, p[t], dp[t], ddp[t]
        )
        rate[t] = model.data.dhg.vector
        com[t] = model.data.com[0]
    force, moment = measured_ground[:, :3], measured_ground[:, 3:]
    residual = rate.copy()
    residual[:, :3] -= weight + force
    residual[:, 3:] -= moment - np.cross(com, force)
    com_by_p = by_ddp[:, :3] / model.skeleton.mass
    by_p[:, 3:] -= skew(force) @ com_by_p
    by_q, by_v, by_a = model.by_coordinates(q, v, a, (by_p, by_dp, by_ddp))
    return MomentumTerms(residual, by_q, by_v, by_a, com)
