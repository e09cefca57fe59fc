"""Which frames' forces count: what was recorded, what one foot can be given, what a review says."""

import numpy as np
from jaxtyping import Bool

from solver.contact.wrenches import TWO_FEET, ContactWrenches, FrameMask
from solver.errors import FitError
from solver.runs import runs

NOT_RECORDED = "hasNoForcePlateData"  # as the B3D format calls it
REVIEWED = "manualReview"  # likewise
TWO_FEET_ON_ONE_PLATE = "two feet on one plate"


def frame_mask(
    contacts: ContactWrenches, imported_missing_force: Bool[np.ndarray, " frames"] | None = None
) -> FrameMask:
    """Every frame counts, but those without recorded force, with two feet on a plate, or that a review flags.

    Args:
        contacts: assigned forces.
        imported_missing_force: from review.json: true where a person says that force is missing or wrong.

    Raises:
        FitError: the review is of another number of frames.
    """
    unrecorded = ~contacts.observed
    shared = (contacts.plate == TWO_FEET).any(axis=1)
    flagged = np.zeros(contacts.frames, dtype=bool)
    if imported_missing_force is not None:
        flagged = imported_missing_force
        if len(flagged) != contacts.frames:
            raise FitError(
                f"The review is of {len(flagged)} frames, the trial has {contacts.frames}. "
                "Export it again, or leave it out."
            )
    out = unrecorded | shared | flagged
    reasons = [
        (start, end, None, reason)
        for flags, reason in (
            (unrecorded, NOT_RECORDED),
            (shared, TWO_FEET_ON_ONE_PLATE),
            (flagged, REVIEWED),
        )
        for start, end in runs(flags)
    ]
    return FrameMask(
        counts=np.repeat(~out[:, None], len(contacts.foot_bodies), axis=1),
        reasons=tuple(sorted(reasons, key=lambda reason: reason[:2])),
        source="none" if imported_missing_force is None else "review.json",
    )
