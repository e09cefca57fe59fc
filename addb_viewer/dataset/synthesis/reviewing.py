"""What reviewers say of a synthetic subject, kept as the app keeps it."""

from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path

from addb_viewer.dataset.synthesis.recording import FEET, RecordedTrial
from addb_viewer.jobs.review_store import open_log
from annotations.events import Edit, Event, FlagRange, SetActivity, SetStatus, Status
from annotations.runs import true_runs

REVIEWERS = ("reviewer A", "reviewer B")
BEGAN = datetime(2024, 1, 8, 9, 0, tzinfo=UTC)
REASON = "notOverForcePlate"


def said_of(trial: RecordedTrial, *, labelled: bool) -> list[Event]:
    """A right and finished review: steps beside the plates, and the activity where it is labelled.

    Args:
        trial: as recorded.
        labelled: whether somebody has said what the person does.
    """
    said: list[Event] = [
        FlagRange(start, end, REASON, foot)
        for k, foot in enumerate(FEET)
        for start, end in true_runs(trial.missed[:, k])
    ]
    if labelled:
        said.append(SetActivity(0, trial.capture.markers.frames, trial.activity, trial.subclass))
    return [*said, SetStatus(Status.FINISHED)]


def keep_reviews(folder: Path, said: Sequence[tuple[str, Event]]) -> None:
    """Write a subject's log; a reviewer takes every other trial.

    Args:
        folder: of the subject.
        said: trial and event, in order.
    """
    trials = list(dict.fromkeys(trial for trial, _ in said))
    edits = [
        Edit(
            number,
            trial,
            REVIEWERS[trials.index(trial) % len(REVIEWERS)],
            BEGAN + timedelta(minutes=number),
            event,
        )
        for number, (trial, event) in enumerate(said, start=1)
    ]
    with open_log(folder) as log:
        log.take_over(edits)
