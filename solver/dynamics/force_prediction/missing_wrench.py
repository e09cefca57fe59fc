"""The wrenches of feet whose force is missing: what the motion demands beyond the feet that were measured."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.contact.wrenches import ContactWrenches, FrameMask
from solver.dynamics.dynamics import Dynamics
from solver.dynamics.force_prediction.divided_wrench import divided
from solver.dynamics.inverse_dynamics import counted_wrenches
from solver.dynamics.root_wrench import about_point
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.skeleton import Skeleton

# Residuals are correlated over it: by half after 0.02 s in a synthetic walk, 0.03 to 0.04 s in a real one.
FADE_S = 0.03  # [s]


def with_predicted_torques(
    skeleton: Skeleton,
    dynamics: Dynamics,
    contacts: ContactWrenches,
    mask: FrameMask,
    predicted_ground: Float[np.ndarray, "frames 6"] | None = None,
) -> Dynamics:
    """The dynamics with torques under `wrenches_by_motion`, and a record of the feet that these rest on.

    Residuals stay as they are: they say what measured forces fail to explain.

    Args:
        skeleton: that the dynamics were computed with.
        dynamics: of the same mask.
        contacts: measured.
        mask: which feet's forces count.
        predicted_ground: wrench of all feet together [N, N·m about the ground origin]; None: what the motion
            demands.
    """
    if mask.counts.all():
        return dynamics
    told = dynamics
    if predicted_ground is not None:
        counted = counted_wrenches(contacts.wrench_ground, mask).sum(axis=1)
        told = replace(dynamics, residual_root=about_point(predicted_ground - counted, dynamics.root_ground))
    wrenches = wrenches_by_motion(skeleton, told, contacts, mask)
    return replace(
        dynamics,
        joint_torques=torques_under(skeleton, told, contacts, mask, wrenches),
        wrench_is_predicted=~mask.counts,
        wrench_predicted_ground=np.where(mask.counts[:, :, None], 0.0, wrenches),
    )


def predicted_torques(
    skeleton: Skeleton, dynamics: Dynamics, contacts: ContactWrenches, mask: FrameMask
) -> Float[np.ndarray, "frames dofs"]:
    """Joint torques under `wrenches_by_motion` [N·m or N].

    Without a wrench on a loaded foot its leg's torques jump as the force goes missing; with the predicted one
    they go on.
    """
    wrenches = wrenches_by_motion(skeleton, dynamics, contacts, mask)
    return torques_under(skeleton, dynamics, contacts, mask, wrenches)


def torques_under(
    skeleton: Skeleton,
    dynamics: Dynamics,
    contacts: ContactWrenches,
    mask: FrameMask,
    wrenches_ground: Float[np.ndarray, "frames feet 6"],
) -> Float[np.ndarray, "frames dofs"]:
    """Joint torques of the dynamics, made anew under these wrenches where a foot's force is missing."""
    torques = dynamics.joint_torques.copy()
    some = np.flatnonzero(~mask.all_feet)
    motion = dynamics.motion.without_derivatives()
    torques[some] = RigidBodyModel(skeleton).inverse_dynamics(
        motion.q[some],
        motion.velocity[some],
        motion.acceleration[some],
        wrenches_ground[some],
        [skeleton.body_index(name) for name in contacts.foot_bodies],
    )
    return torques


def wrenches_by_motion(
    skeleton: Skeleton, dynamics: Dynamics, contacts: ContactWrenches, mask: FrameMask
) -> Float[np.ndarray, "frames feet 6"]:
    """Measured wrenches, and for feet whose force is missing the ones that the motion demands of them.

    One foot missing: it gets what the others leave. Several: `divided` shares the demand out among them.
    What the frames around say otherwise (their residual, and how the plates divided the load) is not dropped
    at once: it fades within `FADE_S`, so that nothing jumps at the borders.

    Args:
        skeleton: that the dynamics were computed with.
        dynamics: of the same mask, so that its residual holds what the missing feet have to give.
        contacts: measured.
        mask: which feet's forces count.

    Returns:
        Force [N] and moment about the ground origin [N·m], ground frame.
    """
    wrenches = counted_wrenches(contacts.wrench_ground, mask)
    missing = ~mask.counts
    demand = about_point(dynamics.residual_root, -dynamics.root_ground)
    single = np.flatnonzero(missing.sum(axis=1) == 1)
    if len(single):
        rest = _faded(dynamics.residual_root, dynamics.used, single, dynamics.motion.rate)
        due = demand[single] - about_point(rest, -dynamics.root_ground[single])
        wrenches[single] += missing[single][:, :, None] * due[:, None, :]
    several = np.flatnonzero(missing.sum(axis=1) > 1)
    if len(several):
        known = dynamics.used.copy()
        known[single] = True
        around = np.union1d(several, np.concatenate(_neighbours(known, several)))
        takes = missing[around] | (missing[around].sum(axis=1) < 2)[:, None]
        whole = demand[around] + (takes[:, :, None] * wrenches[around]).sum(axis=1)
        shares = np.zeros_like(wrenches)
        shares[around] = divided(skeleton, contacts.foot_bodies, dynamics.motion.q[around], whole, takes)
        otherwise = _faded(wrenches - shares, known, several, dynamics.motion.rate)
        wrenches[several] += missing[several][:, :, None] * (shares[several] + otherwise)
    return wrenches


def _faded(
    values: Float[np.ndarray, "frames *axes"],
    known: Bool[np.ndarray, " frames"],
    at: Int[np.ndarray, " some"],
    rate: float,
) -> Float[np.ndarray, "some *axes"]:
    """Values of the known frames around others, fading with distance in time; zero where none is known."""
    if not known.any():
        return np.zeros_like(values[at])
    before, after = _neighbours(known, at)
    gap = np.maximum(after - before, 1)
    wide = (slice(None), *(None,) * (values.ndim - 1))
    towards = np.clip((at - before) / gap, 0.0, 1.0)[wide]
    distance_s = np.minimum(np.abs(after - at), np.abs(at - before)) / rate
    between = (1 - towards) * values[before] + towards * values[after]
    return between * np.exp(-((distance_s / FADE_S) ** 2))[wide]


def _neighbours(
    known: Bool[np.ndarray, " frames"], at: Int[np.ndarray, " some"]
) -> tuple[Int[np.ndarray, " some"], Int[np.ndarray, " some"]]:
    """The last known frame before and the first one after each; one of them twice beyond the ends."""
    frames = np.flatnonzero(known)
    if not len(frames):
        return at, at
    place = np.searchsorted(frames, at)
    return frames[(place - 1).clip(min=0)], frames[place.clip(max=len(frames) - 1)]
