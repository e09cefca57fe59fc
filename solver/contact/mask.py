"""Which frames' forces count: what was recorded, what one foot can be given, what a review says."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Int

from solver.capture.capture import Capture, ImportedReason
from solver.common.errors import FitError
from solver.common.true_runs import runs
from solver.contact.force_review import ForceLabel, ForceReview
from solver.contact.wrenches import (
    DETECTION,
    FILE,
    NOBODY,
    PERSON,
    RECORDING,
    SOURCES,
    TWO_FEET,
    ContactWrenches,
    FrameMask,
    MissingRange,
)

NOT_RECORDED = "hasNoForcePlateData"  # as the B3D format calls it
REVIEWED = "manualReview"  # likewise
TOO_FEW_MARKERS = "too few markers seen"
TWO_FEET_ON_ONE_PLATE = "two feet on one plate"
OUTSIDE_RANGES = "outside the trial's range"
ERRONEOUS = "erroneous"  # a person says that the stretch must not be used at all
UNDER_NO_FOOT = "copOutsideConvexFootError"  # likewise

Labelled = Sequence[tuple[ForceLabel, str]]  # labels, and who says so


def frame_mask(
    contacts: ContactWrenches,
    tracked: Bool[np.ndarray, " frames"],
    review: ForceReview | None = None,
    proposed: Sequence[MissingRange] = (),
    *,
    outside: Bool[np.ndarray, " frames"] | None = None,
) -> FrameMask:
    """Every force counts but those without a recording or a pose, not of one foot, or left out by somebody.

    Args:
        contacts: assigned forces.
        tracked: frames that show enough markers for a pose.
        review: what people and files say.
        proposed: what detection is sure enough of; see `mask_of`.
        outside: frames of no range of the trial, whoever reviewed it; None: all are to be used.

    Raises:
        FitError: the review is of another number of frames, or of another foot.
    """
    nowhere = np.zeros(contacts.frames, dtype=bool)
    gaps = [
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
    return mask_of(contacts.foot_bodies, contacts.frames, gaps, review, proposed)


def mask_of(
    feet: Sequence[str],
    frames: int,
    gaps: Sequence[MissingRange],
    review: ForceReview | None = None,
    proposed: Sequence[MissingRange] = (),
) -> FrameMask:
    """The one rule which forces count.

    What the recording has no force for does not count, whatever anybody says. Else, for each frame and foot,
    the first of these that says anything decides: a person, an imported file, detection. Detection is no
    longer asked when the review is finished: what it had left out and nobody decided stays left out, and the
    rest has been looked at by the person who finished. A stretch that was called erroneous does not count,
    whatever the flags in it say.

    Args:
        feet: names of the foot bodies.
        frames: of the trial.
        gaps: what the recording has no force for.
        review: what people and files say; None: nothing.
        proposed: what detection is sure enough of.

    Raises:
        FitError: a label lies beyond the trial's end, or is about another foot.
    """
    review = review or ForceReview()
    said = [(label, FILE) for label in review.by_file or ()]
    said += [(label, PERSON) for label in review.by_people]
    said.sort(key=lambda labelled: labelled[0].reason == ERRONEOUS)  # stable: erroneous ones at the end
    finished = review.stays_out is not None
    undecided = [ForceLabel(*missing) for missing in (review.stays_out if finished else proposed) or ()]
    layers: Labelled = [*((label, DETECTION) for label in undecided), *said]
    for label, _ in layers:
        _check(label, feet, frames)
    winner = _winners(layers, feet, frames)  # which layer decides, from 1; 0 where none does
    leaves_out = np.array([False, *(label.reason is not None for label, _ in layers)])
    nobody = SOURCES.index(PERSON if finished else NOBODY)
    by = np.array([nobody, *(SOURCES.index(source) for _, source in layers)])
    counts, decided_by = ~leaves_out[winner], by[winner]
    reasons = [(gap, RECORDING) for gap in gaps]
    for label, source in layers:
        holds = ~counts & (decided_by == SOURCES.index(source))
        reasons += [(missing, source) for missing in _pieces(label, holds, feet)]
    reasons.sort(key=lambda reason: reason[0][:2])
    for start, end, foot, _ in gaps:
        counts[start:end, _lane(foot, feet)] = False
    return FrameMask(
        counts=counts,
        reasons=tuple(missing for missing, _ in reasons),
        source=" + ".join(SOURCES[k] for k in sorted(set(decided_by.flat) - {0}, reverse=True)) or NOBODY,
        decided_by=decided_by,
        sources=tuple(source for _, source in reasons),
    )


def with_own_file(review: ForceReview, capture: Capture) -> ForceReview:
    """A review with what the review.json beside the recording says, where no other import took its place.

    Args:
        review: what people and their imports say.
        capture: the recording.

    Raises:
        FitError: the review.json is of another number of frames.
    """
    missing, frames = capture.imported_missing_force, capture.markers.frames
    if review.by_file is not None or missing is None:
        return review
    if len(missing) != frames:
        raise FitError(
            f"The review is of {len(missing)} frames, the trial has {frames}. Export it again, or leave it "
            "out."
        )
    about = capture.imported_reviewed
    about = np.ones(frames, dtype=bool) if about is None else about
    counted = [ForceLabel(start, end, None, None) for start, end in runs(about & ~missing)]
    left_out = [
        ForceLabel(start, end, None, why) for start, end, why in _why_missing(capture, about & missing)
    ]
    return replace(review, by_file=(*counted, *left_out))


def _why_missing(capture: Capture, missing: Bool[np.ndarray, " frames"]) -> Iterator[ImportedReason]:
    """The ranges that the file leaves out, with its reasons where it has any."""
    named = np.zeros(len(missing), dtype=bool)
    for start, end, reason in capture.imported_reasons:
        named[start:end] = True
        yield ImportedReason(start, end, reason)
    yield from (ImportedReason(start, end, REVIEWED) for start, end in runs(missing & ~named))


def _winners(layers: Labelled, feet: Sequence[str], frames: int) -> Int[np.ndarray, "frames feet"]:
    """Which of the layers, counted from 1, is the last one on each frame and foot; 0 where there is none."""
    winner = np.zeros((frames, len(feet)), dtype=np.int64)
    for k, (label, _) in enumerate(layers, start=1):
        winner[label.start : label.end, _lane(label.foot, feet)] = k
    return winner


def _pieces(
    label: ForceLabel, holds: Bool[np.ndarray, "frames feet"], feet: Sequence[str]
) -> list[MissingRange]:
    """Where a label that leaves a force out holds; one range where that is the same for all feet."""
    if label.reason is None:
        return []
    found = {
        foot: [
            (label.start + start, label.start + end) for start, end in runs(holds[label.start : label.end, k])
        ]
        for k, foot in enumerate(feet)
        if label.foot in (None, foot)
    }
    if label.foot is None and len({tuple(each) for each in found.values()}) == 1:
        return [(start, end, None, label.reason) for start, end in found[feet[0]]]
    return [(start, end, foot, label.reason) for foot, each in found.items() for start, end in each]


def _lane(foot: str | None, feet: Sequence[str]) -> slice | int:
    return slice(None) if foot is None else list(feet).index(foot)


def _check(label: ForceLabel, feet: Sequence[str], frames: int) -> None:
    if not 0 <= label.start < label.end <= frames:
        raise FitError(
            f"Frames {label.start} to {label.end - 1} are flagged, but the trial has {frames}: is the review "
            "of another recording? Undo that flag, or leave the review out."
        )
    if label.foot is not None and label.foot not in feet:
        raise FitError(
            f"A flag is about the foot '{label.foot}', the subject has {', '.join(feet)}. "
            "Undo that flag, or leave the review out."
        )
