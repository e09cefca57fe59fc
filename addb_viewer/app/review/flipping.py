"""Another decision than the present one, to ask the solver about."""

from dataclasses import replace

import numpy as np

from addb_viewer.app.trial.foot_names import foot_words
from annotations.reasons import MANUAL_REVIEW
from solver.contact.force_review import ForceLabel, ForceReview
from solver.contact.wrenches import FrameMask


def flipped(
    present: ForceReview, mask: FrameMask, chosen: tuple[int, int], foot: str | None, feet: tuple[str, ...]
) -> tuple[ForceReview, str]:
    """A person's decision on a range turned round: what is mostly left out counts, and the other way round.

    Args:
        present: what people say.
        mask: what comes of that, and of detection.
        chosen: the range.
        foot: that it is about; None for all.
        feet: the mask's.

    Returns:
        What they would say instead, and in words what is asked.
    """
    start, end = chosen
    counts = mask.counts[start:end, slice(None) if foot is None else feet.index(foot)]
    where = f"frames {start} to {end - 1}, {foot_words(foot)}"
    if np.mean(counts) > 0.5:
        label, words = ForceLabel(start, end, foot, MANUAL_REVIEW), f"If {where}, did not count"
    else:
        label, words = ForceLabel(start, end, foot, None), f"If {where}, counted"
    # An erroneous stretch holds whatever else is said; asked about, it is a flag like any other.
    said = [each._replace(reason=each.reason and MANUAL_REVIEW) for each in present.by_people]
    return replace(present, by_people=(*said, label)), words
