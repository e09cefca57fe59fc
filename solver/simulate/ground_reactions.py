"""The demanded wrench shared by the feet: a force at a centre of pressure, and a free vertical moment."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.simulate.contacts import ContactPlan
from solver.skeleton.forward import cross


@dataclass(frozen=True)
class GroundReactions:
    """What the ground does to each foot (right, left); their sum is the demand, exactly."""

    times: Float[np.ndarray, " times"]  # [s]
    force_ground: Float[np.ndarray, "times feet 3"]  # [N]
    cop_ground: Float[np.ndarray, "times feet 3"]  # [m] on the ground plane; NaN while unloaded
    free_moment: Float[np.ndarray, "times feet"]  # [N·m] about the vertical through the centre of pressure

    @property
    def wrench_ground(self) -> Float[np.ndarray, "times feet 6"]:
        """Force [N] and moment about the ground origin [N·m] on each foot."""
        moment = cross(np.nan_to_num(self.cop_ground), self.force_ground)
        moment[..., 1] += self.free_moment
        return np.concatenate([self.force_ground, moment], axis=2)


def share_demand(
    demand_ground: Float[np.ndarray, "times 6"],
    plan: ContactPlan,
    times: Float[np.ndarray, " times"],
) -> GroundReactions:
    """Split a demand so that nothing of it is lost.

    Each foot in contact takes its planned share of the force. Where the demand acts beside the planned centre
    of pressure, the feet's centres of pressure shift alike by that distance. What moment is left about the
    vertical is shared like the force. A foot in front brakes while the one behind pushes: a pair of opposite
    forces along the line between their centres of pressure, which the body doesn't notice.

    Args:
        demand_ground: force [N] and moment about the ground origin [N·m].
        plan: who stands where.
        times: of the demand [s].
    """
    shares = plan.shares(times)
    wanted = np.nan_to_num(plan.centres_of_pressure(times))
    force, moment = demand_ground[:, :3], demand_ground[:, 3:]
    loaded = shares.sum(axis=1) > 0
    vertical = np.where(loaded, force[:, 1], 1.0)
    acts_at = np.stack([moment[:, 2], np.zeros(len(times)), -moment[:, 0]], axis=1) / vertical[:, None]
    beside = np.where(loaded[:, None], acts_at - np.einsum("tf,tfi->ti", shares, wanted), 0.0)
    cop = wanted + beside[:, None]
    feet_force = shares[:, :, None] * force[:, None]

    apart = cop[:, 0] - cop[:, 1]
    distance = np.linalg.norm(apart, axis=1, keepdims=True)
    towards_right = np.divide(apart, distance, out=np.zeros_like(apart), where=distance > 0)
    inner = plan.brace * shares[:, :1] * shares[:, 1:] * towards_right
    feet_force[:, 0] -= inner
    feet_force[:, 1] += inner

    left_over = moment[:, 1] - cross(cop, feet_force)[..., 1].sum(axis=1)
    return GroundReactions(
        times=times,
        force_ground=np.where(loaded[:, None, None], feet_force, 0.0),
        cop_ground=np.where(shares[:, :, None] > 0, cop, np.nan),
        free_moment=np.where(shares > 0, shares * left_over[:, None], 0.0),
    )
