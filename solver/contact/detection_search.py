"""From motion and forces to contact states: evidence is weighed, and again with what it taught."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.ndimage import binary_dilation, maximum_filter1d

from solver.common.runs import runs
from solver.contact.detection_balance import UP, BodyMotion, WholeBody
from solver.contact.detection_motion import ground_odds, slip_speeds, touching_unloaded
from solver.contact.detection_place import place_costs
from solver.contact.detection_settings import DetectionSettings
from solver.contact.detection_shares import Explained, WrenchBalance
from solver.contact.detection_states import (
    ContactStates,
    FrameEvidence,
    likeliest_contact_states,
    missing_odds,
)
from solver.contact.sole import Sole, soles
from solver.contact.wrenches import TWO_FEET, ContactWrenches
from solver.kinematics.motion import Motion
from solver.skeleton.forward import body_poses
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.skeleton import Skeleton

ROUNDS = 3  # of finding the contact states and learning from them; the third rarely changes anything


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
    poses = body_poses(skeleton, motion.low_passed(settings.slip_cutoff_Hz).q)
    corners = tuple(sole.corners_ground(*poses) for sole in outlines)
    slip = slip_speeds(corners, contacts.in_contact, rate, settings)
    ground = ground_odds(slip, settings)
    recorded = recorded_contacts(contacts.in_contact, rate, settings)
    fast, slow = _wrench_balances(_body_motion(skeleton, motion, tracked), contacts, recorded, settings)
    unloaded = touching_unloaded(contacts, ground, fast.body.motion.weight, rate, settings)
    ground = np.where(unloaded, np.minimum(ground, 0.0), ground)
    loaded = contacts.in_contact | (shared[:, None] & (ground > 0))
    jumping = fast.body.jumping
    placed = known & ~_around(jumping, 0.5 * rate / settings.place_cutoff_Hz)
    explained = Explained.nothing(len(recorded), settings)
    for _ in range(ROUNDS):
        missing, error = fast.missing(explained)[:, UP], fast.error(explained)
        frame_evidence = FrameEvidence(
            missing=_clipped(_any_force(missing, error, fast.body, settings), known, settings),
            partly=_clipped(_part_of_force(missing, error, contacts, rate, settings), known, settings),
            ground=ground,
            place=_places(slow, explained, outlines, poses, known=placed, settings=settings),
            loaded=loaded,
            rate=rate,
        )
        contact_states = likeliest_contact_states(frame_evidence, settings)
        unmeasured = (contact_states.lost & ~loaded).any(axis=1) | contact_states.elsewhere | ~known | jumping
        explained = slow.explain(~_around(unmeasured, 0.5 * rate / settings.place_cutoff_Hz), settings)
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
        border=round(settings.border_s * rate),
    )


def _around(flags: Bool[np.ndarray, " frames"], reach: float) -> Bool[np.ndarray, " frames"]:
    """The flagged frames and those nearby, to which a smoother spreads what they show."""
    return binary_dilation(flags, iterations=max(1, round(reach)))


def recorded_contacts(
    in_contact: Bool[np.ndarray, "frames feet"], rate: float, settings: DetectionSettings
) -> tuple[RecordedContact, ...]:
    """Runs of loaded frames of each foot; short gaps don't end them, short runs don't count."""
    found = []
    for foot in range(in_contact.shape[1]):
        flags = in_contact[:, foot].copy()
        for start, end in runs(~flags):
            if start > 0 and end < len(flags) and end - start < settings.shortest_gap_s * rate:
                flags[start:end] = True
        found += [
            RecordedContact(foot, start, end)
            for start, end in runs(flags)
            if end - start >= settings.shortest_contact_s * rate
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
        WrenchBalance.of(
            WholeBody(body, cutoff, settings), wrench.sum(axis=1), own, [c.foot for c in recorded]
        )
        for cutoff in (settings.balance_cutoff_Hz, settings.place_cutoff_Hz)
    )
    return fast, slow


def _any_force(
    missing: Float[np.ndarray, " frames"],
    error: Float[np.ndarray, " frames"],
    body: WholeBody,
    settings: DetectionSettings,
) -> Float[np.ndarray, " frames"]:
    most = settings.most_missing * body.motion.weight
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
        odds.append(missing_odds(missing, doubt, settings.least_lost * carried, settings.most_lost * carried))
    return np.column_stack(odds)


def _clipped(
    odds: Float[np.ndarray, "frames *feet"], known: Bool[np.ndarray, " frames"], settings: DetectionSettings
) -> Float[np.ndarray, "frames *feet"]:
    """No frame says more than a model can be trusted with, and an unknown one says nothing."""
    strongest = settings.strongest_evidence
    return np.where(known[(...,) + (None,) * (odds.ndim - 1)], np.clip(odds, -strongest, strongest), 0.0)


def _places(
    slow: WrenchBalance,
    explained: Explained,
    outlines: Sequence[Sole],
    poses: tuple[Float[np.ndarray, "frames bodies 3 3"], Float[np.ndarray, "frames bodies 3"]],
    *,
    known: Bool[np.ndarray, " frames"],
    settings: DetectionSettings,
) -> dict[tuple[int, ...], Float[np.ndarray, " frames"]]:
    costs = place_costs(slow, explained, outlines, poses, settings)
    return {feet: np.where(known, cost, 0.0) for feet, cost in costs.items()}
