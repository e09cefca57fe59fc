"""From motion and forces to contact states: evidence is weighed, and again with what it taught.

Whether a foot's motion is that of a foot on the ground: some corner of its sole moves with the surface.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import binary_dilation, maximum_filter1d

from solver.common.true_runs import runs
from solver.contact.detection_balance import UP, BodyMotion, WholeBody
from solver.contact.detection_settings import BORDER_S, DROPOUT, LEAST_LOST, MOST_LOST, DetectionSettings
from solver.contact.detection_shares import Explained, WrenchBalance
from solver.contact.detection_states import (
    ContactStates,
    FrameEvidence,
    likeliest_contact_states,
    missing_odds,
    place_costs,
)
from solver.contact.settings import SHORTEST_CONTACT_S
from solver.contact.sole import Sole, soles
from solver.contact.wrenches import TWO_FEET, ContactWrenches
from solver.kinematics.motion import Motion
from solver.skeleton.forward import body_poses
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.skeleton import Skeleton

SHORTEST_GAP_S = 0.04  # [s] shorter gaps don't end a contact: a flight lasts 0.08 s
SLIP_CUTOFF_HZ = 12.0  # [Hz] of the sole's speed; a foot lands within 30 ms
SLIP_M_S = 0.5  # [m/s] a sole's slowest corner on the ground; a swinging one passes at 2 m/s
SLIP_SHARE = 0.2  # of the speed of the trial's swinging feet: runners' soles slip more
LOWEST_PART_M = 0.05  # [m] corners of a sole so near to its lowest one may be those that touch
BELT_WINDOW_S = 1.5  # [s] a treadmill's belt changes its speed more slowly
STRONGEST_MOTION = 2.5  # log odds that a sole's motion can give: a foot may be held still in the air
# [s] a still foot may be without a load for so long, as in a slow double support; a standing foot carries
# something
TOUCHING_S = 0.25
MOST_MISSING = 2.0  # body weights: missing forces are assumed to be anything from none to this
STRONGEST_EVIDENCE = 4.0  # log odds that one moment's balance can give: models fail more often

ROUNDS = 3  # of finding the contact states and learning from them; the third rarely changes anything


def slip_speeds(
    corners_ground: Sequence[Float[np.ndarray, "frames corners 3"]],
    loaded: Bool[np.ndarray, "frames feet"],
    rate: float,
) -> Float[np.ndarray, "frames feet"]:
    """Speed at which each foot's slowest low corner moves against the surface it would stand on [m/s].

    The surface's velocity is learnt from loaded soles near in time: nothing on a floor, the belt's on a
    treadmill, also while it changes. No height is asked for: a step of a staircase is as good as the floor.

    Args:
        corners_ground: of each foot's sole [m], filtered.
        loaded: frames on which a plate carries the foot.
        rate: [Hz].
    """
    velocities = [np.gradient(corners, 1.0 / rate, axis=0) for corners in corners_ground]
    slowest = [_touching_velocity(c, v) for c, v in zip(corners_ground, velocities, strict=True)]
    surface = _surface_velocity(np.stack(slowest, axis=1), loaded, rate, BELT_WINDOW_S)
    columns = []
    for f, (corners, velocity) in enumerate(zip(corners_ground, velocities, strict=True)):
        height = corners[..., 1]
        low = height <= height.min(axis=1, keepdims=True) + LOWEST_PART_M
        against = velocity.copy()
        against[..., [0, 2]] -= surface[:, f, None]
        speed = np.linalg.norm(against, axis=2)
        columns.append(np.where(low, speed, np.inf).min(axis=1))
    return np.stack(columns, axis=1)


def _touching_velocity(
    corners: Float[np.ndarray, "frames corners 3"], velocity: Float[np.ndarray, "frames corners 3"]
) -> Float[np.ndarray, "frames 2"]:
    """Horizontal velocity of the lowest corner [m/s]."""
    lowest = corners[..., 1].argmin(axis=1)
    return velocity[np.arange(len(corners)), lowest][:, [0, 2]]


def _surface_velocity(
    velocity: Float[np.ndarray, "frames feet 2"],
    loaded: Bool[np.ndarray, "frames feet"],
    rate: float,
    window_s: float,
) -> Float[np.ndarray, "frames feet 2"]:
    """Median over loaded frames near in time, of the same foot where it has any; zero without any."""
    frames, feet = loaded.shape
    reach = round(window_s * rate)
    grid = np.unique(np.append(np.arange(0, frames, max(1, reach // 10)), frames - 1))
    own = [np.flatnonzero(loaded[:, f]) for f in range(feet)]
    surface = np.zeros_like(velocity)
    for f in range(feet):
        choices = [[f], [g for g in range(feet) if g != f]]
        known = np.stack([_median_near(velocity, own, choices, t, reach) for t in grid])
        for axis in range(2):
            surface[:, f, axis] = np.interp(np.arange(frames), grid, known[:, axis])
    return surface


def _median_near(
    velocity: Float[np.ndarray, "frames feet 2"],
    own: Sequence[np.ndarray],
    choices: Sequence[Sequence[int]],
    t: int,
    reach: int,
) -> Float[np.ndarray, "2"]:
    for span in (reach, len(velocity)):
        for some in choices:
            pool = [velocity[_near(own[f], t, span), f] for f in some]
            if sum(map(len, pool)):
                return np.median(np.concatenate(pool), axis=0)
    return np.zeros(2)


def _near(frames: np.ndarray, t: int, reach: int) -> np.ndarray:
    return frames[np.searchsorted(frames, t - reach) : np.searchsorted(frames, t + reach + 1)]


def ground_odds(slip: Float[np.ndarray, "frames feet"]) -> Float[np.ndarray, "frames feet"]:
    """Natural log odds that each foot stands: its slip against the trial's own pace.

    Args:
        slip: from `slip_speeds` [m/s].
    """
    pace = np.percentile(slip, 95)
    limit = max(SLIP_M_S, SLIP_SHARE * pace)
    odds = 2.0 * np.log(limit / np.maximum(slip, 1e-3))
    return np.clip(odds, -STRONGEST_MOTION, STRONGEST_MOTION)


def touching_unloaded(
    contacts: ContactWrenches, ground: Float[np.ndarray, "frames feet"], weight_N: float, rate: float
) -> Bool[np.ndarray, "frames feet"]:
    """Frames on which a foot rests on its plate without a load, as the one behind in a slow double support.

    The foot keeps still between two loads of one plate, so it never left that plate; the load fades out and
    in, so the plate did not drop out; it is over soon. Its zero is a measurement then, and a still sole no
    sign of a missing force.

    Args:
        contacts: forces given to feet.
        ground: from `ground_odds`.
        weight_N: of the body.
        rate: [Hz].
    """
    touching = np.zeros_like(contacts.in_contact)
    load = contacts.wrench_raw_ground[..., UP]
    for f in range(contacts.in_contact.shape[1]):
        for start, end in runs(~contacts.in_contact[:, f]):
            if start == 0 or end == contacts.frames or end - start > TOUCHING_S * rate:
                continue
            same_plate = (contacts.plate[start - 1 : end + 1] == f).all(axis=0).any()
            fades = max(load[start - 1, f], load[end, f]) < DROPOUT * weight_N
            touching[start:end, f] = same_plate and fades and (ground[start:end, f] > 0).all()
    return touching


@dataclass(frozen=True)
class RecordedContact:
    """One foot on one or several plates, frames `start` up to, not including, `end`."""

    foot: int
    start: int
    end: int


@dataclass(frozen=True)
class Findings:
    """The contact states and what they rest on."""

    contact_states: ContactStates
    frame_evidence: FrameEvidence
    missing: Float[np.ndarray, " frames"]  # [N] vertical force that nothing explains
    error: Float[np.ndarray, " frames"]  # [N] its standard deviation
    weight: float  # of the body [N]
    slip: Float[np.ndarray, "frames feet"]  # [m/s]
    corners_ground: tuple[Float[np.ndarray, "frames corners 3"], ...]  # [m] of each foot's sole
    recorded: tuple[RecordedContact, ...]
    explained: Explained
    border: int  # [frames] as far as the forces' filter spreads


def search(
    skeleton: Skeleton,
    motion: Motion,
    contacts: ContactWrenches,
    tracked: Bool[np.ndarray, " frames"],
    settings: DetectionSettings,
) -> Findings:
    """Find the contact states that fit balance, place, motion and loads best.

    Args:
        skeleton: scaled, with the person's mass.
        motion: not filtered.
        contacts: forces given to feet.
        tracked: frames that show enough markers for a pose.
        settings: thresholds.
    """
    rate = motion.rate
    shared = (contacts.plate == TWO_FEET).any(axis=1)  # its force is in nobody's account
    known = tracked & contacts.observed & ~_around(shared, rate / settings.balance_cutoff_Hz)
    outlines = soles(skeleton, contacts.foot_bodies)
    poses = body_poses(skeleton, motion.low_passed(SLIP_CUTOFF_HZ).q)
    corners = tuple(sole.corners_ground(*poses) for sole in outlines)
    slip = slip_speeds(corners, contacts.in_contact, rate)
    ground = ground_odds(slip)
    recorded = recorded_contacts(contacts.in_contact, rate)
    fast, slow = _wrench_balances(_body_motion(skeleton, motion, tracked), contacts, recorded, settings)
    unloaded = touching_unloaded(contacts, ground, fast.body.motion.weight, rate)
    ground = np.where(unloaded, np.minimum(ground, 0.0), ground)
    loaded = contacts.in_contact | (shared[:, None] & (ground > 0))
    jumping = fast.body.jumping
    placed = known & ~_around(jumping, 0.5 * rate / settings.place_cutoff_Hz)
    explained = Explained.nothing(len(recorded), settings)
    for _ in range(ROUNDS):
        missing, error = fast.missing(explained)[:, UP], fast.error(explained)
        frame_evidence = FrameEvidence(
            missing=_clipped(_any_force(missing, error, fast.body), known),
            partly=_clipped(_part_of_force(missing, error, contacts, rate, settings), known),
            ground=ground,
            place=_places(slow, explained, outlines, poses, known=placed),
            loaded=loaded,
            rate=rate,
        )
        contact_states = likeliest_contact_states(frame_evidence)
        without_measured_forces = (
            (contact_states.lost & ~loaded).any(axis=1) | contact_states.elsewhere | ~known | jumping
        )
        explained = slow.explain(
            ~_around(without_measured_forces, 0.5 * rate / settings.place_cutoff_Hz), settings
        )
    return Findings(
        contact_states=contact_states,
        frame_evidence=frame_evidence,
        missing=missing,
        error=error,
        weight=fast.body.motion.weight,
        slip=slip,
        corners_ground=corners,
        recorded=recorded,
        explained=explained,
        border=round(BORDER_S * rate),
    )


def _around(flags: Bool[np.ndarray, " frames"], reach: float) -> Bool[np.ndarray, " frames"]:
    """The flagged frames and those nearby, to which a smoother spreads what they show."""
    return binary_dilation(flags, iterations=max(1, round(reach)))


def recorded_contacts(
    in_contact: Bool[np.ndarray, "frames feet"], rate: float
) -> tuple[RecordedContact, ...]:
    """Runs of loaded frames of each foot; short gaps don't end them, short runs don't count."""
    found = []
    for foot in range(in_contact.shape[1]):
        flags = in_contact[:, foot].copy()
        for start, end in runs(~flags):
            if start > 0 and end < len(flags) and end - start < SHORTEST_GAP_S * rate:
                flags[start:end] = True
        found += [
            RecordedContact(foot, start, end)
            for start, end in runs(flags)
            if end - start >= SHORTEST_CONTACT_S * rate
        ]
    return tuple(found)


def _body_motion(skeleton: Skeleton, motion: Motion, tracked: Bool[np.ndarray, " frames"]) -> BodyMotion:
    velocity = motion.without_derivatives().velocity
    com, angular = RigidBodyModel(skeleton).centroidal_momentum(motion.q, velocity)
    gravity = float(np.linalg.norm(skeleton.gravity))
    return BodyMotion(com, angular, tracked, motion.rate, skeleton.mass, gravity)


def _wrench_balances(
    body: BodyMotion,
    contacts: ContactWrenches,
    recorded: Sequence[RecordedContact],
    settings: DetectionSettings,
) -> tuple[WrenchBalance, WrenchBalance]:
    """A fast one for when something is missing, and a slow one for where and how much of which contact."""
    wrench = np.nan_to_num(contacts.wrench_raw_ground)
    own = [(contact.start, wrench[contact.start : contact.end, contact.foot]) for contact in recorded]
    fast, slow = (
        WrenchBalance.of(WholeBody(body, cutoff), wrench.sum(axis=1), own, [c.foot for c in recorded])
        for cutoff in (settings.balance_cutoff_Hz, settings.place_cutoff_Hz)
    )
    return fast, slow


def _any_force(
    missing: Float[np.ndarray, " frames"], error: Float[np.ndarray, " frames"], body: WholeBody
) -> Float[np.ndarray, " frames"]:
    most = MOST_MISSING * body.motion.weight
    return missing_odds(missing, error, np.zeros_like(missing), np.full_like(missing, most))


def _part_of_force(
    missing: Float[np.ndarray, " frames"],
    error: Float[np.ndarray, " frames"],
    contacts: ContactWrenches,
    rate: float,
    settings: DetectionSettings,
) -> Float[np.ndarray, "frames feet"]:
    """Odds that a certain part of a loaded foot's force is missing.

    Right beside frames on which all of it is missing the smoother shows half of that; so much is no evidence.
    """
    reach = max(1, round(0.5 * rate / settings.balance_cutoff_Hz))
    odds = []
    for f in range(contacts.in_contact.shape[1]):
        carried = np.maximum(contacts.wrench_ground[:, f, UP], 1.0)
        beside = maximum_filter1d(np.where(contacts.in_contact[:, f], 0.0, missing), 2 * reach + 1)
        doubt = np.hypot(error, 0.5 * np.maximum(beside, 0.0))
        odds.append(missing_odds(missing, doubt, LEAST_LOST * carried, MOST_LOST * carried))
    return np.column_stack(odds)


def _clipped(
    odds: Float[np.ndarray, "frames *feet"], known: Bool[np.ndarray, " frames"]
) -> Float[np.ndarray, "frames *feet"]:
    """No frame says more than a model can be trusted with, and an unknown one says nothing."""
    strongest = STRONGEST_EVIDENCE
    return np.where(known[(...,) + (None,) * (odds.ndim - 1)], np.clip(odds, -strongest, strongest), 0.0)


def _places(
    slow: WrenchBalance,
    explained: Explained,
    outlines: Sequence[Sole],
    poses: tuple[Float[np.ndarray, "frames bodies 3 3"], Float[np.ndarray, "frames bodies 3"]],
    *,
    known: Bool[np.ndarray, " frames"],
) -> dict[tuple[int, ...], Float[np.ndarray, " frames"]]:
    costs = place_costs(slow, explained, outlines, poses)
    return {feet: np.where(known, cost, 0.0) for feet, cost in costs.items()}
