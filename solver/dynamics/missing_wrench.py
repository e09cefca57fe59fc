"""The wrench of a foot whose force is missing: what the motion demands beyond the other foot's."""

import numpy as np
from jaxtyping import Bool, Float

from solver.contact.wrenches import ContactWrenches, FrameMask
from solver.dynamics.dynamics import Dynamics
from solver.dynamics.inverse_dynamics import counted_wrenches
from solver.dynamics.root_wrench import about_point
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.skeleton import Skeleton


def inferred_wrenches(
    dynamics: Dynamics, contacts: ContactWrenches, mask: FrameMask
) -> Float[np.ndarray, "frames feet 6"]:
    """Measured wrenches, and on frames that lack one foot's the one that the motion demands of it.

    What measured forces leave unexplained before and after such frames is not laid on the foot: that residual
    is led on across them, so that nothing jumps at their borders. Where two feet's forces are missing nothing
    tells how they share the demand; they stay zero.

    Args:
        dynamics: of the same mask, so that its residual holds what the missing foot has to give.
        contacts: measured.
        mask: which feet's forces count.

    Returns:
        Force [N] and moment about the ground origin [N·m], ground frame.
    """
    wrenches = counted_wrenches(contacts.wrench_ground, mask)
    missing = ~mask.counts & ((~mask.counts).sum(axis=1) == 1)[:, None]
    if not missing.any():
        return wrenches
    foot_root = dynamics.residual_root - _bridged(dynamics.residual_root, dynamics.used)
    foot_ground = about_point(foot_root, -dynamics.root_ground)
    return np.where(missing[:, :, None], foot_ground[:, None, :], wrenches)


def _bridged(
    residual_root: Float[np.ndarray, "frames 6"], used: Bool[np.ndarray, " frames"]
) -> Float[np.ndarray, "frames 6"]:
    """The residual of used frames, led on straight across the others; zero where no frame is used."""
    if not used.any():
        return np.zeros_like(residual_root)
    frames = np.arange(len(used))
    return np.stack([np.interp(frames, frames[used], column[used]) for column in residual_root.T], axis=1)


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
