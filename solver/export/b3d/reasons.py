"""Why a frame's force does not count, as the numbers of the format."""

import numpy as np
from jaxtyping import Int

from solver.capture.formats.b3d.reasons import REASONS
from solver.contact.mask import (
    ERRONEOUS,
    NOT_RECORDED,
    OUTSIDE_RANGES,
    REVIEWED,
    TOO_FEW_MARKERS,
    TWO_FEET_ON_ONE_PLATE,
)
from solver.contact.wrenches import RECORDING, SOURCES, FrameMask

NEAREST = {
    TOO_FEW_MARKERS: "hasInputOutliers",
    TWO_FEET_ON_ONE_PLATE: "notOverForcePlate",  # no plate to itself
    OUTSIDE_RANGES: REVIEWED,
    ERRONEOUS: REVIEWED,
}  # reasons of our own and the format's nearest one

UNNAMED = "unmeasuredExternalForceDetected"  # the force doesn't count, and nobody said why


def reason_number(reason: str) -> int:
    """The format's number of a reason; in words that neither it nor we know, a person has spoken."""
    name = NEAREST.get(reason, reason)
    return REASONS.index(name if name in REASONS else REVIEWED)


def reasons_per_frame(mask: FrameMask | None, frames: int) -> Int[np.ndarray, " frames"]:
    """Zero where every foot's force counts, else the number of the reason.

    Args:
        mask: of the trial; None where it has no forces.
        frames: of the trial.
    """
    if mask is None:
        return np.full(frames, reason_number(NOT_RECORDED), np.int32)
    numbers = np.array([*(reason_number(reason[3]) for reason in mask.reasons), REASONS.index(UNNAMED)])
    return np.where(mask.all_feet, 0, numbers[decisive_reasons(mask)]).astype(np.int32)


def decisive_reasons(mask: FrameMask) -> Int[np.ndarray, " frames"]:
    """Which of `mask.reasons` is each frame's, by its place; −1 where there is none.

    A person's reason goes before a file's, that before detection's, and all before what the recording itself
    has no force for. Of several of one source the first holds.

    Args:
        mask: of the trial.
    """
    decisive = np.full(len(mask.counts), -1)
    heard = np.zeros(len(mask.counts), np.int32)  # place of the source that gave the reason, from 1
    order = (RECORDING, *SOURCES)
    for k, (start, end, _foot, reason) in enumerate(mask.reasons):
        stretch, before = decisive[start:end], heard[start:end]
        by_person = reason_number(reason) == REASONS.index(REVIEWED)  # of a fit that kept no sources
        rank = 1 + order.index(mask.sources[k]) if mask.sources else 1 + by_person
        taken = rank > before
        stretch[taken], before[taken] = k, rank
    return decisive
