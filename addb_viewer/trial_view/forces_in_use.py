"""Which forces the solve on the screen counted, and which the next one will."""

import numpy as np

from addb_viewer.jobs.force_reviews import force_review
from addb_viewer.trial_view.frame_ranges import Stop
from addb_viewer.trial_view.replay import ForceUse, Replay
from annotations.foot_names import foot_words
from annotations.trial_review import TrialReview
from solver.common.errors import FitError
from solver.contact.detected_ranges import sure_ranges
from solver.contact.mask import (
    NOT_RECORDED,
    OUTSIDE_RANGES,
    TOO_FEW_MARKERS,
    TWO_FEET_ON_ONE_PLATE,
    mask_of,
)
from solver.contact.wrenches import RECORDING, FrameMask, MissingRange

_OF_THE_RECORDING = (NOT_RECORDED, OUTSIDE_RANGES, TOO_FEW_MARKERS, TWO_FEET_ON_ONE_PLATE)


def contacts_at(replay: Replay, frame: int, foot: str | None) -> list[Stop]:
    """The contacts on a frame, of one foot or, for None, of all."""
    return [
        (phase.start, phase.end, replay.feet[phase.foot])
        for phase in replay.forces.contacts
        if phase.start <= frame < phase.end and foot in (None, replay.feet[phase.foot])
    ]


def contact_words(replay: Replay, frame: int, foot: str | None) -> str:
    """What keys act on where nothing is selected: `contacts_at` in words, or that nobody is in view."""
    if not replay.in_view[frame]:
        return "no contact: nobody is in view on this frame"
    contacts = contacts_at(replay, frame, foot)
    if not contacts:
        return "no contact on this frame"
    return " and ".join(f"{foot_words(foot)} {start}–{end - 1}" for start, end, foot in contacts)


def mask_now(feet: tuple[str, ...], forces: ForceUse, review: TrialReview) -> FrameMask | None:
    """The mask that the next solve obeys, as far as the present fit tells: detection may look again.

    Args:
        feet: of the trial.
        forces: that the fit used.
        review: what people decided, its review.json included.

    Returns:
        None where the trial has no forces, or where a label does not fit the recording.
    """
    if forces.counts is None or set(review.feet) - set(feet):
        return None
    sure = sure_ranges(forces.proposals, forces.confidence)
    try:
        return mask_of(feet, len(forces.counts), gaps_of(forces), force_review(review), sure)
    except FitError:  # a solve says which and what to do
        return None


def gaps_of(forces: ForceUse) -> tuple[MissingRange, ...]:
    """What the recording has no force for, whatever anybody says."""
    if forces.sources:
        return tuple(m for m, by in zip(forces.missing, forces.sources, strict=True) if by == RECORDING)
    return tuple(m for m in forces.missing if m[3] in _OF_THE_RECORDING)  # a fit of an earlier version


def is_changed(feet: tuple[str, ...], forces: ForceUse, review: TrialReview) -> bool:
    """Whether the next solve counts other forces than the fit did; arguments as for `mask_now`."""
    now, used = mask_now(feet, forces, review), forces.counts
    return now is not None and used is not None and not np.array_equal(now.counts, used)
