"""The labels of a subject as a CSV table, out and in: for a spreadsheet, for statistics, for another lab."""

import csv
from collections.abc import Iterable, Mapping
from io import StringIO

from annotations.events import ClearRange, FlagRange, ImportTable, SetActivity, SetStatus, Status
from annotations.reasons import FORCE_COUNTS, reason_named
from annotations.review_errors import ReviewError
from annotations.trial_review import ActivityRange, ClearedRange, FlaggedRange, TrialReview

LABELS = ("reason", "activity", "status")  # a row has one of these
TAKEN = ("trial", "start", "end", "foot", "reason", "activity", "subclass", "status", "note")
COLUMNS = (*TAKEN[:-1], "source", "author", "edit", "confidence", "detector", "note")

Row = dict[str, object]
Label = FlagRange | ClearRange | SetActivity | SetStatus


def ranges_csv(reviews: Iterable[TrialReview]) -> str:
    """One line a range, and one a trial for its status.

    Frames from `start` to `end` − 1; `foot` is empty where all feet are meant. The reason `notMissingGRF`
    says that somebody has decided that the force counts.
    """
    text = StringIO()
    writer = csv.DictWriter(text, COLUMNS, restval="", lineterminator="\n")
    writer.writeheader()
    for review in reviews:
        writer.writerows(_rows(review))
    return text.getvalue()


def tables_from_csv(
    text: str, file: str, by: str, frames: Mapping[str, int], feet: Iterable[str]
) -> tuple[dict[str, ImportTable], tuple[str, ...]]:
    """The labels of a table as edits, one a trial.

    Args:
        text: the table, with a head; rows have `trial` and one of `reason`, `activity` and `status`.
        file: its name, for messages and the log.
        by: who takes it in.
        frames: of each trial of the subject.
        feet: names of the subject's foot bodies.

    Returns:
        The edits by trial, and the columns that were left out.

    Raises:
        ReviewError: a row that cannot be taken, with its line.
    """
    head = text.partition("\n")[0]
    reader = csv.DictReader(StringIO(text, newline=""), delimiter="," if "," in head else ";", strict=True)
    known, found = tuple(feet), dict[str, list[Label]]()
    try:
        columns = tuple(reader.fieldnames or ())
        if "trial" not in columns or not set(LABELS) & set(columns):
            raise ReviewError(f"{file}: needs a header row with 'trial' and one of {', '.join(LABELS)}")
        for row in reader:
            try:
                trial, label = _read(row, frames, known)
            except ReviewError as error:
                raise ReviewError(f"{file}, line {reader.line_num}: {error}") from error
            found.setdefault(trial, []).append(label)
    except csv.Error as error:
        raise ReviewError(f"{file}, after line {reader.line_num}: not CSV ({error})") from error
    tables = {trial: _table(labels, file, by) for trial, labels in found.items()}
    return tables, tuple(column for column in columns if column not in TAKEN)


def _rows(review: TrialReview) -> list[Row]:
    said: list[FlaggedRange | ClearedRange | ActivityRange]
    said = [*review.flags, *(review.stays_out or ()), *review.cleared, *review.activities]
    ranges = sorted(said, key=lambda labelled: labelled.start)
    rows = [{"trial": review.trial, **_row(labelled)} for labelled in ranges]
    if review.status_author is not None:
        rows.append(
            {
                "trial": review.trial,
                "status": review.status.value,
                "author": review.status_author,
                "note": review.status_note,
            }
        )
    return rows


def _row(labelled: FlaggedRange | ClearedRange | ActivityRange) -> Row:
    row: Row = {
        "start": labelled.start,
        "end": labelled.end,
        "author": labelled.author,
        "edit": labelled.edit,
        "note": labelled.note,
    }
    if isinstance(labelled, ActivityRange):
        return row | {"activity": labelled.activity, "subclass": labelled.subclass or ""}
    row |= {"foot": labelled.foot or "", "source": labelled.source.value}
    if isinstance(labelled, ClearedRange):
        return row | {"reason": FORCE_COUNTS}
    confidence = "" if labelled.confidence is None else f"{labelled.confidence:.3g}"
    return row | {"reason": labelled.reason, "confidence": confidence, "detector": labelled.detector}


def _read(
    row: Mapping[str, str | None], frames: Mapping[str, int], feet: tuple[str, ...]
) -> tuple[str, Label]:
    if None in row:
        raise ReviewError("more cells than the header has columns")
    cells = {name: (row.get(name) or "").strip() for name in TAKEN}
    trial = cells["trial"]
    if trial not in frames:
        raise ReviewError(f"no trial '{trial}'; the subject has {', '.join(frames)}")
    given = [name for name in LABELS if cells[name]]
    if len(given) != 1:
        raise ReviewError(f"give one of {', '.join(LABELS)} in a row, not {len(given)}")
    note = row.get("note") or ""
    if given == ["status"]:
        return trial, SetStatus(_status(cells["status"]), note)
    start, end = _number(cells, "start"), _number(cells, "end")
    if end > frames[trial]:
        raise ReviewError(f"{start}:{end} is not within the trial, which is 0:{frames[trial]}")
    if given == ["activity"]:
        return trial, SetActivity(start, end, cells["activity"], cells["subclass"] or None, note)
    foot = cells["foot"] or None
    if foot is not None and foot not in feet:
        raise ReviewError(f"no foot '{foot}'; the subject has {', '.join(feet)}; empty for all")
    if cells["reason"] == FORCE_COUNTS:
        return trial, ClearRange(start, end, foot, note)
    return trial, FlagRange(start, end, reason_named(cells["reason"]), foot, note)


def _number(cells: Mapping[str, str], name: str) -> int:
    try:
        return int(cells[name])
    except ValueError as error:
        raise ReviewError(f"'{cells[name]}' is not a frame number; '{name}' needs one") from error


def _status(word: str) -> Status:
    try:
        return Status(word)
    except ValueError as error:
        raise ReviewError(f"no status '{word}'; there are {', '.join(Status)}") from error


def _table(labels: Iterable[Label], file: str, by: str) -> ImportTable:
    said = tuple(labels)
    statuses = [label for label in said if isinstance(label, SetStatus)]
    return ImportTable(
        file=file,
        by=by,
        ranges=tuple(label for label in said if isinstance(label, FlagRange | ClearRange)),
        activities=tuple(label for label in said if isinstance(label, SetActivity)),
        status=statuses[-1].status if statuses else None,
        status_note=statuses[-1].note if statuses else "",
    )
