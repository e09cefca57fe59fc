"""The wrench of a foot whose force is missing: what the motion demands beyond the other foot's."""

import numpy as np
from jaxtyping import Float

from solver.contact.wrenches import ContactWrenches, FrameMask
from solver.dynamics.dynamics import Dynamics
from solver.dynamics.inverse_dynamics import counted_wrenches
from solver.dynamics.root_wrench import about_point
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.skeleton import Skeleton

# Residuals are correlated over it: by half after 0.02 s in a synthetic walk, 0.03 to 0.04 s in a real one.
FADE_S = 0.03  # [s]


def inferred_wrenches(
    dynamics: Dynamics, contacts: ContactWrenches, mask: FrameMask
) -> Float[np.ndarray, "frames feet 6"]:
    """Measured wrenches, and on frames that lack one foot's the one that the motion demands of it.

    What the measured forces leave unexplained just before and after such frames is not laid on the foot at
    once: that residual fades within `FADE_S`, so that nothing jumps at the borders. Where two feet's
    forces are missing nothing tells how they share the demand; they stay zero.

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
    foot_root = dynamics.residual_root - _fading(dynamics)
    foot_ground = about_point(foot_root, -dynamics.root_ground)
    return np.where(missing[:, :, None], foot_ground[:, None, :], wrenches)


def _fading(dynamics: Dynamics) -> Float[np.ndarray, "frames 6"]:
    """The residual of the used frames around, fading with distance in time; zero where none is used."""
    known = np.flatnonzero(dynamics.used)
    if not len(known):
        return np.zeros_like(dynamics.residual_root)
    frames = np.arange(len(dynamics.used))
    led_on = np.stack([np.interp(frames, known, c[known]) for c in dynamics.residual_root.T], axis=1)
    after = known[np.searchsorted(known, frames).clip(max=len(known) - 1)]
    before = known[(np.searchsorted(known, frames, side="right") - 1).clip(min=0)]
    distance_s = np.minimum(np.abs(after - frames), np.abs(frames - before)) / dynamics.motion.rate
    return led_on * np.exp(-((distance_s / FADE_S) ** 2))[:, None]


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
