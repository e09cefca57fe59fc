"""What the queue's page and the server say to each other: JSON, one message a line of a conversation."""

import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from addb_viewer.app.jobs.fit_all import Fitting
from addb_viewer.app.queue.pace import Pair, Share
from addb_viewer.app.queue.rows import Row
from addb_viewer.app.subjects.people import TrialPlace
from annotations.errors import ReviewError
from annotations.work import Comment, CommentThread, WorkItem

MOST_TRIALS = 100_000
LONGEST = 10_000  # characters of a text


@dataclass(frozen=True)
class Asked:
    """What somebody at the page wants; what it does not need is empty."""

    what: str  # one of WANTS
    places: tuple[TrialPlace, ...] = ()
    text: str = ""  # a name, a comment, a format, a browser
    frame: int | None = None
    number: int | None = None  # of a comment


WANTS = (
    "hello",
    "order",
    "fit",
    "diagnose",
    "export",
    "assign",
    "comment",
    "settle",
    "comments",
    "people",
    "cancel",
    "anew",
)


def asked(message: str | bytes) -> Asked:
    """A message of the page.

    Raises:
        ReviewError: it is none.
    """
    try:
        said = json.loads(message)
        what, places = said["what"], [tuple(place) for place in said.get("places", ())]
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise ReviewError("that is no message of the queue's page") from error
    text, numbers = said.get("text", ""), [said.get("frame"), said.get("number")]
    right = (
        what in WANTS
        and len(places) <= MOST_TRIALS
        and all(len(place) == 2 and all(isinstance(part, str) for part in place) for place in places)
        and isinstance(text, str)
        and len(text) <= LONGEST
        and all(n is None or (type(n) is int and 0 <= n < 2**53) for n in numbers)
    )
    if not right:
        raise ReviewError("that is no message of the queue's page")
    return Asked(what, tuple(places), text, *numbers)


def row_words(row: Row) -> dict[str, Any]:
    """A row as the page keeps it; numbers without a meaning are None."""
    last = max(row.marks, key=lambda mark: mark.at, default=None)
    return {
        "subject": row.subject,
        "trial": row.trial,
        "error": row.error,
        "status": str(row.status),
        "by": row.by or "",
        "fitted": row.figures is not None,
        "score": None if row.error else round(row.badness, 3),
        "residual": _rounded(row.residual),
        "leftOut": _rounded(row.left_out),
        "byMachine": row.undecided and row.figures is not None,
        "open": row.proposed,
        "frames": row.frames,
        "used": [list(run) for run in (row.figures or {}).get("frames_used_ranges", ())],
        "proposals": [[p.start, p.end, round(p.confidence, 2), p.state] for p in row.proposals],
        "reviewed": [list(run) for run in row.reviewed],
        "conflicts": [list(run) for run in row.conflicts],
        "activity": ", ".join(row.activities),
        "causes": list(row.causes),
        "sources": list(row.sources),
        "assigned": row.assigned_to,
        "comments": row.comments,
        "openComments": row.open_comments,
        "waiting": list(row.waiting),
        "last": None if last is None else [last.author, round(last.at)],
        "people": sorted({mark.author for mark in row.marks}),
    }


def live_words(
    people: Mapping[TrialPlace, Sequence[str]],
    present: Collection[str],
    at_work: Mapping[str, str],
    states: Mapping[str, Fitting],
) -> dict[str, Any]:
    """Who is where, and what is at work."""
    return {
        "kind": "live",
        "present": sorted(present),
        "here": [[*place, list(names)] for place, names in sorted(people.items())],
        "work": dict(at_work),
        "batches": {
            kind: {
                "running": state.running,
                "by": state.by,
                "done": state.fitted,
                "total": state.total,
                "subject": state.subject,
                "stage": state.stage,
                "fraction": state.fraction,
                "heldUp": state.held_up,
                "left": state.seconds_left,
                "failures": dict(state.failures),
                "warnings": dict(state.warnings),
                "waiting": list(state.waiting),
            }
            for kind, state in states.items()
            if state.total
        },
    }


def people_words(shares: Sequence[Share], pairs: Sequence[Pair], hours_left: float | None) -> dict[str, Any]:
    """Who has done how much, and how far they agree."""
    return {
        "kind": "people",
        "hoursLeft": _rounded(hours_left),
        "people": [
            {
                "name": share.name,
                "finished": share.finished,
                "edits": share.edits,
                "hours": _rounded(share.hours),
                "anHour": _rounded(share.an_hour),
                "last": None if share.last is None else round(share.last),
                "assigned": share.assigned,
            }
            for share in shares
        ],
        "pairs": [
            {
                "one": pair.one,
                "other": pair.other,
                "trials": pair.trials,
                "kappa": _rounded(pair.kappa),
                "same": _rounded(pair.same),
            }
            for pair in pairs
        ],
    }


def comments_words(place: TrialPlace, comments: Sequence[CommentThread]) -> dict[str, Any]:
    """The comments on a trial."""
    return {
        "kind": "comments",
        "place": list(place),
        "comments": [
            {
                "number": thread.number,
                "frame": thread.frame,
                "settledBy": thread.settled_by,
                "said": [_said(item) for item in (thread.first, *thread.answers)],
            }
            for thread in comments
        ],
    }


def _said(item: WorkItem) -> list[Any]:
    text = item.event.text if isinstance(item.event, Comment) else ""
    return [item.author, round(item.made_at.timestamp()), text]


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 4)
