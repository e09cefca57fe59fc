"""The wrenches of feet whose force is missing: what the motion demands beyond the feet that were measured.

Where no force counts at all, a marker fit's accelerations are noise above a few hertz, so its momentum is
smoothed as a low-pass of third order would. The ground only pushes. Where the smooth momentum would have it
pull, the body flies: force and moment about the centre of mass are zero there, and the smoothing is done
again with that known. In a run the impulse that a filter smears into flight then goes back to where a foot
stands.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.interpolate import make_interp_spline
from scipy.linalg import solveh_banded

from solver.contact.wrenches import ContactWrenches, FrameMask
from solver.dynamics.dynamics import BodyLoad, Dynamics
from solver.dynamics.force_prediction.divided_wrench import divide_wrench
from solver.dynamics.inverse_dynamics import counted_wrenches
from solver.dynamics.root_wrench import about_point
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.skeleton import Skeleton

# Residuals are correlated over it: by half after 0.02 s in a synthetic walk, 0.03 to 0.04 s in a real one.
FADE_S = 0.03  # [s]

# the second one knows where the body flies; a third takes stance for flight: a run errs by 15 % more
PASSES = 2
FLIGHT_WEIGHT_S2 = 10.0  # [s²] of a force in flight against a momentum off; 1 to 1000 differ by 3 %
ORDER = 3  # of the differences that are kept small, as of the shared low-pass
FEWEST_FRAMES = 8  # below it a trial has no accelerations


def with_joint_torques(
    skeleton: Skeleton,
    dynamics: Dynamics,
    contacts: ContactWrenches,
    mask: FrameMask,
    predicted_ground: Float[np.ndarray, "frames 6"] | None = None,
    *,
    acting: Sequence[BodyLoad] = (),
) -> Dynamics:
    """The dynamics with torques under all that acts, and a record of the feet whose wrench is predicted.

    Measured wrenches act where they count, and `wrenches_by_motion` where one is missing: without a wrench on
    a loaded foot its leg's torques would jump as the force goes missing. Residuals stay as they are: they say
    what measured forces fail to explain.

    Args:
        skeleton: that the dynamics were computed with.
        dynamics: of the same mask.
        contacts: measured.
        mask: which feet's forces count.
        predicted_ground: wrench of all feet together [N, N·m about the ground origin]; None: what the motion
            demands.
        acting: on segments, beside the feet's wrenches; the residual is what they leave.
    """
    if mask.counts.all():
        if not acting:
            return dynamics
        torques = torques_under(skeleton, dynamics, contacts, mask, acting=acting)
        return replace(dynamics, joint_torques=torques)
    predicted = dynamics
    if predicted_ground is not None:
        counted = counted_wrenches(contacts.wrench_ground, mask).sum(axis=1)
        missing = about_point(predicted_ground - counted, dynamics.root_ground)
        predicted = replace(dynamics, residual_root=missing)
    wrenches = wrenches_by_motion(skeleton, predicted, contacts, mask)
    return replace(
        dynamics,
        joint_torques=torques_under(skeleton, dynamics, contacts, mask, wrenches, acting=acting),
        wrench_is_predicted=~mask.counts,
        wrench_predicted_ground=np.where(mask.counts[:, :, None], 0.0, wrenches),
    )


def torques_under(
    skeleton: Skeleton,
    dynamics: Dynamics,
    contacts: ContactWrenches,
    mask: FrameMask,
    wrenches_ground: Float[np.ndarray, "frames feet 6"] | None = None,
    *,
    acting: Sequence[BodyLoad] = (),
) -> Float[np.ndarray, "frames dofs"]:
    """Joint torques τ − Jᵀ w of the dynamics [N·m or N]: nothing else changes them.

    Args:
        skeleton: that the dynamics were computed with.
        dynamics: under the measured wrenches that count.
        contacts: measured.
        mask: which feet's forces count.
        wrenches_ground: of all feet, under which torques are made anew where a foot's force is missing; None:
            none is.
        acting: on segments, beside the feet's wrenches.
    """
    torques, model = dynamics.joint_torques, RigidBodyModel(skeleton)
    if wrenches_ground is not None:
        torques, some = torques.copy(), np.flatnonzero(~mask.all_feet)
        motion = dynamics.motion.without_derivatives()
        torques[some] = model.inverse_dynamics(
            motion.q[some],
            motion.velocity[some],
            motion.acceleration[some],
            wrenches_ground[some],
            [skeleton.body_index(name) for name in contacts.foot_bodies],
        )
    if acting:
        bodies = [skeleton.body_index(body) for body, _ in acting]
        stacked = np.stack([wrench for _, wrench in acting], axis=1)
        q, rest = dynamics.motion.q, np.zeros_like(dynamics.motion.q)
        torques = torques + (
            model.inverse_dynamics(q, rest, rest, stacked, bodies)
            - model.inverse_dynamics(q, rest, rest, np.zeros_like(stacked), bodies)
        )
    return torques


def wrenches_by_motion(
    skeleton: Skeleton, dynamics: Dynamics, contacts: ContactWrenches, mask: FrameMask
) -> Float[np.ndarray, "frames feet 6"]:
    """Measured wrenches, and for feet whose force is missing the ones that the motion demands of them.

    One foot missing: it gets what the others leave. Several: `divide_wrench` shares the demand out among
    them. What the frames around say otherwise (their residual, and how the plates divided the load) is not
    dropped at once: it fades within `FADE_S`, so that nothing jumps at the borders.

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
        shares[around] = divide_wrench(
            skeleton, contacts.foot_bodies, dynamics.motion.q[around], whole, takes
        )
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


@dataclass(frozen=True)
class PredictedForces:
    """Predicted from the motion alone."""

    wrench_ground: Float[np.ndarray, "frames 6"]  # of all feet [N, N·m about the ground origin]
    flies: Bool[np.ndarray, " frames"]  # nothing touches the ground; the wrench is zero


def predict_ground_forces(
    demand_ground: Float[np.ndarray, "frames 6"],
    com_ground: Float[np.ndarray, "frames 3"],
    rate: float,
    cutoff_Hz: float,
) -> PredictedForces:
    """The wrench that the ground exerts on all feet together.

    Args:
        demand_ground: external wrench that the motion demands, hardly filtered [N, N·m about the ground
            origin].
        com_ground: of the whole body [m].
        rate: [Hz].
        cutoff_Hz: where the smoothing lets half pass.
    """
    frames = len(demand_ground)
    flies = np.zeros(frames, dtype=bool)
    demand = about_point(demand_ground, com_ground)
    if frames < FEWEST_FRAMES:
        return PredictedForces(demand_ground, flies)
    times = np.arange(frames) / rate
    momentum = make_interp_spline(times, demand, k=3).antiderivative()(times)
    for again in range(PASSES):
        smooth = _smoothed(momentum, flies, rate, cutoff_Hz)
        wrench = make_interp_spline(times, smooth, k=3).derivative()(times)
        if again < PASSES - 1:
            flies = wrench[:, 1] < 0
    wrench[flies] = 0.0
    return PredictedForces(about_point(wrench, -com_ground), flies)


def _smoothed(
    momentum: Float[np.ndarray, "frames 6"], flies: Bool[np.ndarray, " frames"], rate: float, cutoff_Hz: float
) -> Float[np.ndarray, "frames 6"]:
    """Nearest to the momentum with small third differences, and none of the first order in flight."""
    frames = len(momentum)
    banded = np.zeros((ORDER + 1, frames))
    banded[-1] = 1.0
    bend = (rate / (2 * np.pi * cutoff_Hz)) ** (2 * ORDER)
    held = FLIGHT_WEIGHT_S2 * rate**2 * (flies[1:] & flies[:-1])
    for coefficients, weights in (
        (np.array([-1.0, 3.0, -3.0, 1.0]), np.full(frames - ORDER, bend)),
        (np.array([-1.0, 1.0]), held),
    ):
        reach, rows = len(coefficients), len(weights)
        for i in range(reach):
            for j in range(i, reach):
                product = coefficients[i] * coefficients[j] * weights
                banded[ORDER - (j - i), j : j + rows] += product
    return solveh_banded(banded, momentum)
