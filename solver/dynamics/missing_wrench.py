"""The wrench of a foot whose force is missing: what the motion demands beyond the other foot's."""

import numpy as np
from jaxtyping import Float

from solver.contact.wrenches import ContactWrenches, FrameMask
from solver.dynamics.dynamics import Dynamics
from solver.dynamics.inverse_dynamics import counted_wrenches
from solver.dynamics.root_wrench import about_point
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.skeleton import Skeleton


def inferred_wrenches(
    dynamics: Dynamics, contacts: ContactWrenches, mask: FrameMask
) -> Float[np.ndarray, "frames feet 6"]:
    """Measured wrenches, and on frames that lack one foot's the one that leaves no residual.

    Where two feet's forces are missing nothing tells how they share the demand; they stay zero.

    Args:
        dynamics: of the same mask, so that its residual is what the missing foot has to give.
        contacts: measured.
        mask: which feet's forces count.

    Returns:
        Force [N] and moment about the ground origin [N·m], ground frame.
    """
    wrenches = counted_wrenches(contacts.wrench_ground, mask)
    demanded = about_point(dynamics.residual_root, -dynamics.root_ground)
    one_missing = (~mask.counts).sum(axis=1) == 1
    missing = ~mask.counts & one_missing[:, None]
    return np.where(missing[:, :, None], demanded[:, None, :], wrenches)


def inferred_torques(
    skeleton: Skeleton, dynamics: Dynamics, contacts: ContactWrenches, mask: FrameMask
) -> Float[np.ndarray, "frames dofs"]:
    """Joint torques under `inferred_wrenches` [N·m or N].

    Without a wrench on a loaded foot its leg's torques jump as the force goes missing; with the inferred one
    they go on.
    """
    motion = dynamics.motion
    return RigidBodyModel(skeleton).inverse_dynamics(
        motion.q,
        motion.velocity,
        motion.acceleration,
        inferred_wrenches(dynamics, contacts, mask),
        [skeleton.body_index(name) for name in contacts.foot_bodies],
    )
