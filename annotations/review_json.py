"""AddBiomechanics' review.json and REVIEWED: labels in as the reviewer `imported`, ours out in the same form.

review.json holds `missing_grf_data`, one boolean a frame of the segment, true where forces are missing or
wrong; an empty file REVIEWED beside it says that a person has finished.
"""

import json
import os
import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Bool

from annotations.activities import ERRONEOUS
from annotations.events import IMPORTED, ImportLabels, Status
from annotations.label_runs import true_runs
from annotations.reasons import MANUAL_REVIEW
from annotations.review_errors import ReviewError
from annotations.trial_review import ActivityRange, ClearedRange, FlaggedRange, TrialReview

if TYPE_CHECKING:
    from annotations.log import ReviewLog

KEY = "missing_grf_data"
FINISHED = "REVIEWED"


def import_labels(
    log: "ReviewLog",
    trial: str,
    missing: Bool[np.ndarray, " frames"],
    finished: bool,
    reviewed: Bool[np.ndarray, " frames"] | None = None,
) -> int | None:
    """Record the labels of a trial's review.json, unless they are the ones that were imported last.

    People's own labels stay as they are: imported ones count only where nobody has decided.

    Args:
        log: the subject's.
        trial: its name.
        missing: of the whole trial, its segments put together: true where the force is missing.
        finished: whether a file REVIEWED lay beside each of them.
        reviewed: frames that they are about; None: all.

    Returns:
        The edit's number; None where there was nothing new.
    """
    labels = labels_of(missing, finished, reviewed)
    last = log.last_import(trial, ImportLabels)
    if last is not None and last.event == labels:
        return None
    return log.append(trial, labels, IMPORTED)


def labels_of(
    missing: Bool[np.ndarray, " frames"], finished: bool, reviewed: Bool[np.ndarray, " frames"] | None
) -> ImportLabels:
    """A trial's review.json as an edit; arguments as for `import_labels`."""
    unreviewed = () if reviewed is None else tuple(true_runs(~reviewed))
    return ImportLabels(tuple(true_runs(missing)), len(missing), finished, unreviewed)


def export_labels(review: TrialReview, frames: int, folder: Path) -> list[Path]:
    """Write a trial's review as one segment that covers the whole trial.

    A frame is missing as soon as one foot's force is: the form knows no feet.

    Args:
        review: of the trial.
        frames: of the trial.
        folder: gets TRIAL/segment_1/review.json and, for a finished trial, REVIEWED beside it.

    Returns:
        The files written.

    Raises:
        ReviewError: there is a review already, or the folder cannot be written to.
    """
    segment = folder / _folder_name(review.trial) / "segment_1"
    missing = review.missing(frames).any(axis=1)
    written = segment / "review.json"
    try:
        segment.mkdir(parents=True, exist_ok=True)
        _write_new(written, json.dumps({KEY: missing.tolist()}))
        if review.status is not Status.FINISHED:
            return [written]
        _write_new(segment / FINISHED, "")
    except FileExistsError as error:
        raise ReviewError(
            f"{error.filename}: exists already and is not overwritten; choose another folder"
        ) from error
    except OSError as error:
        raise ReviewError(
            f"{error.filename}: cannot be written ({error.strerror}); choose another folder"
        ) from error
    return [written, segment / FINISHED]


def lost_in_review_json(review: TrialReview) -> tuple[str, ...]:
    """What a trial's review says that review.json has no place for."""
    ranges: tuple[FlaggedRange | ClearedRange | ActivityRange, ...]
    ranges = (*review.flags, *review.cleared, *review.activities)
    labels = {
        "which foot": any(flag.foot is not None for flag in review.flags),
        "reasons": any(flag.reason != MANUAL_REVIEW for flag in review.flags),
        "notes": bool(review.status_note) or any(labelled.note for labelled in ranges),
        "activities": any(activity.activity != ERRONEOUS for activity in review.activities),
        "the status": review.status in (Status.IN_WORK, Status.SECOND_LOOK),
        "who disagrees with whom": bool(review.conflicts),
    }
    return tuple(name for name, is_there in labels.items() if is_there)


def _folder_name(trial: str) -> str:
    """A trial's name with what file systems dislike, or what leads elsewhere, as %xx a byte."""
    return re.sub(r"[^\w .+-]|^\.", lambda match: "".join(f"%{b:02x}" for b in match[0].encode()), trial)


def _write_new(path: Path, text: str) -> None:
    with path.open("x", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
