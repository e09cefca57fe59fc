"""Why a frame's force does not count, as the numbers of the format."""

import numpy as np
from jaxtyping import Int

from solver.capture.b3d.reasons import REASONS
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

    A person's reason goes before a file's, that before detection's, and all before what the recording itself
    has no force for.

    Args:
        mask: of the trial; None where it has no forces.
        frames: of the trial.
    """
    if mask is None:
        return np.full(frames, reason_number(NOT_RECORDED), np.int32)
    numbers = np.zeros(frames, np.int32)
    heard = np.zeros(frames, np.int32)  # place of the source that gave the number, from 1
    order = (RECORDING, *SOURCES)
    for k, (start, end, _foot, reason) in enumerate(mask.reasons):
        number, stretch, before = reason_number(reason), numbers[start:end], heard[start:end]
        by_person = number == REASONS.index(REVIEWED)  # as far as a fit that kept no sources tells
        rank = 1 + order.index(mask.sources[k]) if mask.sources else 1 + by_person
        taken = rank > before
        stretch[taken], before[taken] = number, rank
    numbers[~mask.all_feet & (numbers == 0)] = REASONS.index(UNNAMED)
    numbers[mask.all_feet] = 0
    return numbers
