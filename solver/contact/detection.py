"""Frames with missing force: each kind of evidence in a module of its own, one story that fits them best."""

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import binary_closing, binary_dilation
from jaxtyping import Bool

from solver.capture.capture import ForcePlate
from solver.contact.detection_balance import BodyMotion, WholeBody
from solver.contact.detection_motion import ground_odds, slip_speeds
from solver.contact.detection_place import place_costs
from solver.contact.detection_shares import Explained, RecordedContact, explain
from solver.contact.detection_settings import DetectionSettings
from solver.contact.detection_states import Clues, Foot, Story, likeliest_story, missing_odds
from solver.contact.proposals import (
    CONTACT_BUT_NO_FORCE,
    FORCE_DISCREPANCY,
    NO_PLATE_DATA,
    UNMEASURED_EXTERNAL_FORCE,
    Proposal,
)
from solver.contact.sole import soles
from solver.contact.wrenches import TWO_FEET, ContactWrenches
from solver.kinematics.motion import Motion
from solver.runs import runs
from solver.skeleton.forward import body_poses
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.skeleton import Skeleton


def detect(
    skeleton: Skeleton,
    motion: Motion,
    contacts: ContactWrenches | None,
    plates: Sequence[ForcePlate],
    *,
    tracked: Bool[np.ndarray, " frames"] | None = None,
    settings: DetectionSettings | None = None,
) -> tuple[Proposal, ...]:
    """Propose the ranges of frames on which a foot's force is missing or wrong.

    Args:
        skeleton: scaled, with the person's mass.
        motion: as the markers gave it, not filtered.
        contacts: forces given to feet; None where the trial has no plates.
        plates: as recorded.
        tracked: frames that show enough markers for a pose; None: all.
        settings: thresholds.

    Returns:
        In order of time. Ranges of different reasons may overlap.
    """
    settings = settings or DetectionSettings()
    if contacts is None:
        return (Proposal((0, motion.frames), None, NO_PLATE_DATA, 1.0),)
    tracked = np.ones(motion.frames, dtype=bool) if tracked is None else tracked
    evidence = _evidence(skeleton, motion, contacts, tracked, settings)
    proposals = _of_story(*evidence, contacts=contacts, rate=motion.rate, settings=settings)
    return tuple(sorted(proposals, key=lambda p: (p.range, p.foot or "")))


def _evidence(skeleton, motion, contacts, tracked, settings):
    rate, gravity = motion.rate, float(np.linalg.norm(skeleton.gravity))
    filtered = body_poses(skeleton, motion.low_passed(settings.slip_cutoff_Hz).q)
    outlines = soles(skeleton, contacts.foot_bodies)
    corners = [sole.corners_ground(*filtered) for sole in outlines]
    slip = slip_speeds(corners, contacts.in_contact, rate, settings)
    on_ground = ground_odds(slip, settings)
    shared = (contacts.plate == TWO_FEET).any(axis=1)
    loaded = contacts.in_contact | (shared[:, None] & (on_ground > 0))
    com, angular = RigidBodyModel(skeleton).centroidal_momentum(motion.q, motion.velocity)
    body = BodyMotion(com, angular, tracked, rate, skeleton.mass, gravity)
    fast, slow = (
        WholeBody(body, cutoff, settings) for cutoff in (settings.balance_cutoff_Hz, settings.place_cutoff_Hz)
    )
    wrench = np.nan_to_num(contacts.wrench_raw_ground)
    recorded = _recorded(contacts, rate)
    own = [_own(wrench, c) for c in recorded]
    seen = {b: b.passed(wrench.sum(axis=1)) for b in (fast, slow)}
    parts = {b: [b.passed(w) for w in own] for b in (fast, slow)}
    explained = Explained.nothing(len(recorded), settings)
    for _ in range(3):
        missing = {}
        for b in (fast, slow):
            of_trial, deviation = explained.of_trial(b, seen[b])
            missing[b] = b.demanded - seen[b] - of_trial
            missing[b] -= sum((x * w for x, w in zip(explained.missing, parts[b]) if x), np.zeros(6))
            if b is fast:
                error = np.hypot(b.noise, deviation)
        most, strongest = settings.most_missing * body.weight, settings.strongest_evidence
        odds = missing_odds(missing[fast][:, 1], error, 0.0, most, strongest)
        carried = np.maximum(contacts.wrench_ground[:, :, 1], 1.0)
        partly = np.column_stack(
            [
                missing_odds(
                    missing[fast][:, 1],
                    error,
                    settings.least_lost * force,
                    settings.most_lost * force,
                    strongest,
                )
                for force in carried.T
            ]
        )
        odds, partly = np.where(tracked, odds, 0.0), np.where(tracked[:, None], partly, 0.0)
        places = place_costs(slow, missing[slow], outlines, filtered, settings)
        places = {feet: np.where(tracked, cost, 0.0) for feet, cost in places.items()}
        story = likeliest_story(Clues(odds, partly, on_ground, places, loaded, rate), settings)
        unmeasured = ((story.feet == Foot.LOST) & ~loaded).any(axis=1) | story.elsewhere | ~tracked
        usable = ~binary_dilation(unmeasured, iterations=max(1, round(0.5 / settings.place_cutoff_Hz * rate)))
        explained = explain(slow, seen[slow], parts[slow], usable, settings)
        if '-d' in __import__('sys').argv: print('trial', explained.trial.round(3), [(c,x.round(2),e.round(1)) for c,x,e in zip(recorded,explained.missing,explained.evidence) if x])
    parts=[(c,x,e) for c,x,e in zip(recorded, explained.missing, explained.evidence) if x]
    return story, missing[fast][:, 1], error, odds, slip, parts


def _recorded(contacts, rate):
    found = []
    for f in range(len(contacts.foot_bodies)):
        loaded = binary_closing(np.pad(contacts.in_contact[:, f], 20), iterations=max(1, round(0.02*rate)))[20:-20] | contacts.in_contact[:, f]
        found += [RecordedContact(f, a, b) for a, b in runs(loaded) if b - a > 0.05 * rate]
    return found


def _own(wrench, c):
    own = np.zeros((len(wrench), 6))
    own[c.start : c.end] = wrench[c.start : c.end, c.foot]
    return own


def _of_story(story, balance, error, odds, slip, parts, *, contacts, rate, settings):
    frames = len(odds)
    border = round(settings.border_s * rate)
    for c, x, e in parts:
        yield Proposal(
            (max(0, c.start - border), min(frames, c.end + border)),
            contacts.foot_bodies[c.foot],
            FORCE_DISCREPANCY,
            float(1 / (1 + np.exp(-e / 4))),
            {"missing_share": x / (1 + x)},
        )
    for f, foot in enumerate(contacts.foot_bodies):
        known = contacts.in_contact[:, f]
        for start, end in runs(story.feet[:, f] == Foot.LOST):

            part = slice(start, end)
            loaded = contacts.in_contact[part, f].mean()
            gain = odds[part].sum() / (settings.steady_s * rate)
            yield Proposal(
                (max(0, start - border), min(frames, end + border)),
                foot,
                FORCE_DISCREPANCY if loaded > 0.5 else CONTACT_BUT_NO_FORCE,
                float(1 / (1 + np.exp(-gain / 4))),
                {
                    "missing_N": float(balance[part].mean()),
                    "error_N": float(error[part].mean()),
                    "measured_N": float(contacts.wrench_raw_ground[part, f, 1].mean()),
                    "slip_m_s": float(np.median(slip[part, f])),
                },
            )
    for start, end in runs(story.elsewhere):
        part = slice(start, end)
        yield Proposal(
            (max(0, start - border), min(frames, end + border)),
            None,
            UNMEASURED_EXTERNAL_FORCE,
            0.9,
            {"missing_N": float(balance[part].mean())},
        )
