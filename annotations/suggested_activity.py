"""What a program suggests that a person does on some frames; it says nothing until somebody confirms it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from annotations.events import NamedActivity, RefuseActivity
from annotations.label_runs import true_runs
from annotations.open_proposals import SAME
from annotations.trial_review import TrialReview


@dataclass(frozen=True)
class SuggestedActivity(NamedActivity):
    """An activity of a range of frames, and how sure that is."""

    confidence: float = 1.0  # 0 to 1
    by: str = ""  # what suggests it


def open_suggestions(
    suggested: Sequence[SuggestedActivity], review: TrialReview
) -> tuple[SuggestedActivity, ...]:
    """What still waits for a person: the frames of suggestions that nobody, and no file, has labelled.

    A suggestion that somebody refused is not made again, also where it is found a few frames off.

    Args:
        suggested: of one trial.
        review: of the same trial.
    """
    labelled = np.zeros(max((s.end for s in suggested), default=0), dtype=bool)
    for said in review.activities:
        labelled[said.start : said.end] = True
    return tuple(
        replace(suggestion, start=suggestion.start + first, end=suggestion.start + last)
        for suggestion in suggested
        if not any(_same(suggestion, refused) for refused in review.refused_activities)
        for first, last in true_runs(~labelled[suggestion.start : suggestion.end])
    )


def _same(one: SuggestedActivity, other: RefuseActivity) -> bool:
    common = min(one.end, other.end) - max(one.start, other.start)
    shorter = min(one.end - one.start, other.end - other.start)
    alike = (one.activity, one.subclass) == (other.activity, other.subclass)
    return alike and common >= SAME * shorter
