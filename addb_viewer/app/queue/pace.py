"""Who has done how much of the queue, how fast, how far two reviewers agree, and how much is left."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from addb_viewer.app.queue.queue_rows import Mark, Row
from addb_viewer.jobs.review_store import open_log
from annotations.agreement import agreement
from solver.capture.capture import Subject

PAUSE_S = 600.0  # longer ones between two edits are no work
AT_LEAST_S = 600.0  # of work, before a pace is told


@dataclass(frozen=True)
class Share:
    """One reviewer's."""

    name: str
    finished: int = 0  # trials whose last finishing is theirs
    edits: int = 0
    hours: float = 0.0  # between edits, pauses left out
    last: float | None = None  # [s] since 1970, of the last edit
    assigned: int = 0  # trials, not finished, that they are to review

    @property
    def an_hour(self) -> float | None:
        """Trials finished in an hour of work; None before there is any pace."""
        return self.finished / self.hours if 3600 * self.hours >= AT_LEAST_S and self.finished else None


@dataclass(frozen=True)
class Pair:
    """How far two reviewers agree about missing forces, on the trials that both have judged."""

    one: str
    other: str
    trials: int
    kappa: float | None  # None: both gave all the same one label
    same: float  # share of frames and feet


def shares(rows: Sequence[Row]) -> list[Share]:
    """Of everybody who has edited or is to review anything, who has finished most first."""
    marks: dict[str, list[Mark]] = {}
    for mark in (mark for row in rows for mark in row.marks):
        marks.setdefault(mark.author, []).append(mark)
    assigned = [row.assigned_to for row in rows if row.assigned_to and not row.finished]
    finished = [row.by for row in rows if row.finished]
    found = [
        Share(
            name,
            finished.count(name),
            len(marks.get(name, ())),
            _hours([mark.at for mark in marks.get(name, ())]),
            max((mark.at for mark in marks.get(name, ())), default=None),
            assigned.count(name),
        )
        for name in {*marks, *assigned}
    ]
    return sorted(found, key=lambda share: (-share.finished, -share.edits, share.name))


def hours_left(rows: Sequence[Row]) -> float | None:
    """How long what is left takes at everybody's pace taken together; None where nobody has one."""
    found = shares(rows)
    work, done = sum(share.hours for share in found), sum(share.finished for share in found)
    left = sum(not (row.finished or row.error) for row in rows)
    return left * work / done if done and 3600 * work >= AT_LEAST_S else None


def _hours(times: Sequence[float]) -> float:
    gaps = np.diff(np.sort(times))
    return float(gaps[gaps <= PAUSE_S].sum()) / 3600


def pairs(rows: Sequence[Row], subjects: Mapping[str, Subject]) -> list[Pair]:
    """How far people agree, over all trials that two of them have judged, taken together.

    Args:
        rows: of the queue; those without a fit are left out, as nobody knows how many frames they have.
        subjects: by name, those of the rows that two people have edited.

    Raises:
        ReviewError: a review cannot be read.
    """
    labels: dict[tuple[str, str], list[tuple[np.ndarray, np.ndarray]]] = {}
    for row in rows:
        names = sorted({mark.author for mark in row.marks})
        if row.subject not in subjects or len(names) < 2 or not row.frames:
            continue
        subject = subjects[row.subject]
        with open_log(subject.folder) as log:
            opinions = {name: log.review(row.trial, subject.foot_bodies, by=name) for name in names}
        judged = [name for name in names if opinions[name].judged(row.frames).any()]
        for pair in combinations(judged, 2):
            one, other = (opinions[name].missing(row.frames) for name in pair)
            labels.setdefault(pair, []).append((one, other))
    return [_pair(names, found) for names, found in sorted(labels.items())]


def _pair(names: tuple[str, str], found: Sequence[tuple[np.ndarray, np.ndarray]]) -> Pair:
    compared = agreement(
        np.concatenate([one for one, _ in found]), np.concatenate([other for _, other in found])
    )
    return Pair(*names, len(found), None if np.isnan(compared.kappa) else compared.kappa, compared.same)


def seen_by_two(rows: Sequence[Row]) -> list[str]:
    """Subjects with a trial that two people have edited."""
    return list(dict.fromkeys(row.subject for row in rows if len({mark.author for mark in row.marks}) > 1))
