"""Frames with missing force: what a reviewer should look at, and what a fit leaves out until one has.

Four kinds of evidence meet in contact states (`detection_search`): the balance of the whole body, where the
missing force presses, how the soles move, and which plates are loaded. What plates and centres of pressure
show by themselves comes beside it.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Bool, Float

from solver.capture.capture import ForcePlate
from solver.common.runs import runs
from solver.contact.detection_balance import UP
from solver.contact.detection_plates import plate_faults
from solver.contact.detection_reasons import proposals_of
from solver.contact.detection_search import search
from solver.contact.detection_settings import DetectionSettings
from solver.contact.proposals import COP_OUTSIDE_FOOT, NO_PLATE_DATA, Proposal
from solver.contact.sole import soles
from solver.contact.wrenches import TWO_FEET, ContactWrenches
from solver.kinematics.motion import Motion
from solver.skeleton.forward import body_poses
from solver.skeleton.skeleton import Skeleton

FEWEST_FRAMES = 8  # below it a trial has no accelerations


def detect(
    skeleton: Skeleton,
    motion: Motion,
    contacts: ContactWrenches | None,
    plates: Sequence[ForcePlate],
    *,
    tracked: Bool[np.ndarray, " frames"] | None = None,
    settings: DetectionSettings,
) -> tuple[Proposal, ...]:
    """Propose the ranges of frames on which a foot's force is missing or wrong.

    Args:
        skeleton: scaled, with the person's mass.
        motion: as the markers gave it, not filtered.
        contacts: forces given to feet; None where the trial has no plates.
        plates: as recorded, in the order of `contacts.plate`.
        tracked: frames that show enough markers for a pose; None: all.
        settings: thresholds.

    Returns:
        In order of time. Ranges of different reasons may overlap.
    """
    if contacts is None or not contacts.observed.any():
        return (Proposal((0, motion.frames), None, NO_PLATE_DATA, 1.0),)
    tracked = np.ones(motion.frames, dtype=bool) if tracked is None else tracked
    found = [Proposal(span, None, NO_PLATE_DATA, 1.0) for span in runs(~contacts.observed)]
    if motion.frames >= FEWEST_FRAMES:
        found += _within_recording(skeleton, motion, contacts, plates, tracked=tracked, settings=settings)
    return tuple(sorted(found, key=lambda p: (p.range, p.foot or "", p.reason)))


def _within_recording(
    skeleton: Skeleton,
    motion: Motion,
    contacts: ContactWrenches,
    plates: Sequence[ForcePlate],
    *,
    tracked: Bool[np.ndarray, " frames"],
    settings: DetectionSettings,
) -> Iterator[Proposal]:
    weight = skeleton.mass * float(np.linalg.norm(skeleton.gravity))
    findings = search(skeleton, motion, contacts, tracked, settings)
    poses = body_poses(skeleton, motion.q)
    yield from proposals_of(findings, contacts, plates, settings)
    for proposal in (
        *wrong_pressure(skeleton, poses, contacts, motion.rate, settings),
        *plate_faults(plates, contacts, motion.times, weight, settings),
    ):
        yield proposal.widened(findings.border, motion.frames)


def wrong_pressure(
    skeleton: Skeleton,
    poses: tuple[Float[np.ndarray, "frames bodies 3 3"], Float[np.ndarray, "frames bodies 3"]],
    contacts: ContactWrenches,
    rate: float,
    settings: DetectionSettings,
) -> Iterator[Proposal]:
    """Stretches on which a well loaded foot's centre of pressure lies clearly beside its sole.

    Its moment is wrong then, though its force may be right. Where two feet stand on one plate the force
    cannot be divided, and both feet's are missing.

    Args:
        skeleton: scaled.
        poses: orientations and origins of all bodies.
        contacts: forces given to feet.
        rate: [Hz].
        settings: thresholds.
    """
    for foot, sole in enumerate(soles(skeleton, contacts.foot_bodies)):
        load = contacts.wrench_ground[:, foot, UP]
        well = contacts.in_contact[:, foot] & (load > settings.cop_load * load.max(initial=0.0))
        distance = np.where(well, sole.distance(*poses, contacts.cop_ground[:, foot]), 0.0)
        distance = np.nan_to_num(distance)
        for start, end in runs(distance > settings.cop_outside_m):
            if end - start >= settings.cop_outside_s * rate:
                worst = float(distance[start:end].max())
                yield Proposal(
                    (start, end),
                    contacts.foot_bodies[foot],
                    COP_OUTSIDE_FOOT,
                    1.0 - 0.5 * settings.cop_outside_m / worst,
                    {"outside_m": worst, "limit_m": settings.cop_outside_m},
                )
    for start, end in runs((contacts.plate == TWO_FEET).any(axis=1)):
        yield Proposal((start, end), None, COP_OUTSIDE_FOOT, 1.0, {"feet_on_one_plate": 2.0})
