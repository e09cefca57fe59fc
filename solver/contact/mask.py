"""Which frames' forces count: what was recorded, what one foot can be given, what a review says."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool

from solver.contact.wrenches import TWO_FEET, ContactWrenches, FrameMask, MissingRange
from solver.errors import FitError
from solver.runs import runs

NOT_RECORDED = "hasNoForcePlateData"  # as the B3D format calls it
REVIEWED = "manualReview"  # likewise
TOO_FEW_MARKERS = "too few markers seen"
TWO_FEET_ON_ONE_PLATE = "two feet on one plate"
OUTSIDE_RANGES = "outside the trial's range"
ERRONEOUS = "erroneous"  # a person says that the stretch must not be used at all
UNDER_NO_FOOT = "copOutsideConvexFootError"  # likewise


def frame_mask(
    contacts: ContactWrenches,
    tracked: Bool[np.ndarray, " frames"],
    imported: Bool[np.ndarray, " frames"] | None,
    review: Sequence[MissingRange] | None = None,
    proposed: Sequence[MissingRange] | None = None,
    *,
    outside: Bool[np.ndarray, " frames"] | None = None,
) -> FrameMask:
    """Every force counts but those without a recording or a pose, not of one foot, or flagged.

    Args:
        contacts: assigned forces.
        tracked: frames that show enough markers for a pose.
        imported: from review.json: true where a person says that force is missing or wrong.
        review: what people decided here, per foot; where it is given, `imported` is not asked.
        proposed: what detection is sure enough of; asked only where nobody reviewed the trial.
        outside: frames of no range of the trial, whoever reviewed it; None: all are to be used.

    Raises:
        FitError: the review is of another number of frames, or of another foot.
    """
    nowhere = np.zeros(contacts.frames, dtype=bool)
    flagged, source = _flagged(contacts, imported, review, proposed)
    ranges = [
        (start, end, None, reason)
        for out, reason in (
            (~contacts.observed, NOT_RECORDED),
            (~tracked, TOO_FEW_MARKERS),
            ((contacts.plate == TWO_FEET).any(axis=1), TWO_FEET_ON_ONE_PLATE),
            (nowhere if contacts.unassigned is None else contacts.unassigned, UNDER_NO_FOOT),
            (nowhere if outside is None else outside, OUTSIDE_RANGES),
        )
        for start, end in runs(out)
    ]
    counts = np.ones((contacts.frames, len(contacts.foot_bodies)), dtype=bool)
    for start, end, foot, _ in (*ranges, *flagged):
        counts[start:end, slice(None) if foot is None else contacts.foot_bodies.index(foot)] = False
    return FrameMask(
        counts=counts,
        reasons=tuple(sorted((*ranges, *flagged), key=lambda missing: missing[:2])),
        source=source,
    )


def _flagged(
    contacts: ContactWrenches,
    imported: Bool[np.ndarray, " frames"] | None,
    review: Sequence[MissingRange] | None,
    proposed: Sequence[MissingRange] | None,
) -> tuple[list[MissingRange], str]:
    """What is taken out, and by whom: people's own review, else an imported one, else proposals."""
    if review is not None:
        for missing in review:
            _check(missing, contacts)
        return list(review), "review"
    if imported is None:
        return list(proposed or ()), "none" if proposed is None else "proposals"
    if len(imported) != contacts.frames:
        raise FitError(
            f"The review is of {len(imported)} frames, the trial has {contacts.frames}. "
            "Export it again, or leave it out."
        )
    return [(start, end, None, REVIEWED) for start, end in runs(imported)], "review.json"


def _check(missing: MissingRange, contacts: ContactWrenches) -> None:
    start, end, foot, _ = missing
    if not 0 <= start < end <= contacts.frames:
        raise FitError(
            f"Frames {start} to {end - 1} are flagged, but the trial has {contacts.frames}: is the review of "
            "another recording? Undo that flag, or leave the review out."
        )
    if foot is not None and foot not in contacts.foot_bodies:
        raise FitError(
            f"A flag is about the foot '{foot}', the subject has {', '.join(contacts.foot_bodies)}. "
            "Undo that flag, or leave the review out."
        )
