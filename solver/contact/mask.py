"""Which frames' forces count: what was recorded, what one foot can be given, what a review says."""

import numpy as np
from jaxtyping import Bool

from solver.contact.wrenches import TWO_FEET, ContactWrenches, FrameMask
from solver.errors import FitError
from solver.runs import runs

NOT_RECORDED = "hasNoForcePlateData"  # as the B3D format calls it
REVIEWED = "manualReview"  # likewise
TOO_FEW_MARKERS = "too few markers seen"
TWO_FEET_ON_ONE_PLATE = "two feet on one plate"


def frame_mask(
    contacts: ContactWrenches,
    tracked: Bool[np.ndarray, " frames"],
    missing: Bool[np.ndarray, " frames"] | None,
) -> FrameMask:
    """Every frame counts but those without recorded force or a pose, with two feet on a plate, or flagged.

    Args:
        contacts: assigned forces.
        tracked: frames that show enough markers for a pose.
        missing: from review.json: true where a person says that force is missing or wrong.

    Raises:
        FitError: the review is of another number of frames.
    """
    unrecorded = ~contacts.observed
    untracked = ~tracked
    shared = (contacts.plate == TWO_FEET).any(axis=1)
    flagged = np.zeros(contacts.frames, dtype=bool)
    if missing is not None:
        flagged = missing
        if len(flagged) != contacts.frames:
            raise FitError(
                f"The review is of {len(flagged)} frames, the trial has {contacts.frames}. "
                "Export it again, or leave it out."
            )
    out = unrecorded | untracked | shared | flagged
    reasons = [
        (start, end, None, reason)
        for flags, reason in (
            (unrecorded, NOT_RECORDED),
            (untracked, TOO_FEW_MARKERS),
            (shared, TWO_FEET_ON_ONE_PLATE),
            (flagged, REVIEWED),
        )
        for start, end in runs(flags)
    ]
    return FrameMask(
        counts=np.repeat(~out[:, None], len(contacts.foot_bodies), axis=1),
        reasons=tuple(sorted(reasons, key=lambda reason: reason[:2])),
        source="none" if missing is None else "review.json",
    )
