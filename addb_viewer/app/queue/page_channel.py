"""The queue's page: its files, and the connection over which it hears of rows and says what is wanted."""

import asyncio
import contextlib
import json
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Annotated, Any, Literal

import msgspec
from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

from addb_viewer.app.jobs.fit_all import Fitting
from addb_viewer.app.page.notices import log_error
from addb_viewer.app.queue.batches import DIAGNOSE, EXPORT, FIT, Batches, formats
from addb_viewer.app.queue.pace import hours_left, pairs, seen_by_two, shares
from addb_viewer.app.queue.queue_rows import Row
from addb_viewer.app.queue.trial_queue import TrialQueue
from addb_viewer.app.security.own_pages import MOST_BYTES, OwnPages
from addb_viewer.app.subjects.people import TrialPlace
from addb_viewer.jobs.review_store import open_log
from addb_viewer.text.amounts import counted
from addb_viewer.trial_view.trial_verdict import TrialVerdict
from annotations.review_errors import ReviewError
from annotations.work import Comment, CommentThread, Settle, WorkItem, work_of
from solver.common.errors import SolverError

MOST_TRIALS = 100_000
LONGEST = 10_000  # characters of a text
MOST_NUMBER = 2**53  # which a browser counts exactly

Look = Literal["hello", "order", "comments", "people", "anew"]
Act = Literal["fit", "diagnose", "export", "cancel", "assign", "comment", "settle"]  # in somebody's name
Number = Annotated[int, msgspec.Meta(ge=0, lt=MOST_NUMBER)]


@dataclass(frozen=True)
class Asked:
    """What somebody at the page wants; what it does not need is empty."""

    what: Look | Act
    places: Annotated[tuple[TrialPlace, ...], msgspec.Meta(max_length=MOST_TRIALS)] = ()
    text: Annotated[str, msgspec.Meta(max_length=LONGEST)] = ""  # a name, a comment, a format, a browser
    frame: Number | None = None
    number: Number | None = None  # of a comment


def asked(message: str | bytes) -> Asked:
    """A message of the page.

    Raises:
        ReviewError: it is none.
    """
    try:
        return msgspec.json.decode(message, type=Asked)
    except (msgspec.MsgspecError, ValueError, RecursionError) as error:
        raise ReviewError("that is no message of the queue's page") from error


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
        "verdict": None if row.verdict is None else _verdict_words(row.verdict),
        "leftOut": None if row.left_out is None else round(row.left_out, 4),
        "open": row.proposed,
        "frames": row.frames,
        "used": [list(run) for run in (row.figures.frames_used_ranges if row.figures else ())],
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


def batch_words(states: Mapping[str, Fitting]) -> dict[str, Any]:
    """How far what is done to many subjects is, by kind."""
    return {
        kind: {**asdict(state), "total": state.total, "left": state.seconds_left}
        for kind, state in states.items()
        if state.total
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


def _verdict_words(trial: TrialVerdict) -> list[str]:
    """Sign, use, and the rest of the trial's line."""
    line = trial.line
    return [line.sign, line.use, " · ".join(filter(None, (line.frames, line.why, line.open)))]


PAGE, FILES, CONNECTION = "/queue", "/queue-files", "/addb/queue"
TOGETHER_S = 0.1  # changes within so long go to the page at once

Message = dict[str, Any]


class QueuePage:
    """Serves the page to all browsers."""

    def __init__(self, trials: TrialQueue, own: OwnPages, login: str) -> None:
        """Serve from now on.

        Args:
            trials: the queue.
            own: pages of this server.
            login: name that is suggested to who has not said one yet.
        """
        self.trials, self.batches, self._login = trials, Batches(trials), login
        own.add_folder("addb_viewer.app.queue.web", FILES, PAGE)
        own.connections[CONNECTION] = self._serve

    def close(self) -> None:
        """End the work that was asked for on it."""
        self.batches.close()

    async def _serve(self, connection: ServerConnection) -> None:
        loop, changed = asyncio.get_running_loop(), asyncio.Event()

        def tell() -> None:
            with contextlib.suppress(RuntimeError):  # the server ends just now
                loop.call_soon_threadsafe(changed.set)

        end = self.trials.people.watch(tell)
        visitor = Visitor(self, lambda: connection.state.name == "OPEN")
        telling = asyncio.create_task(_tell(connection, visitor, changed))
        try:
            async for message in connection:
                if len(message) > MOST_BYTES:
                    raise ReviewError("that is no message of the queue's page")
                for answer in await asyncio.to_thread(visitor.answer, asked(message)):
                    await connection.send(json.dumps(answer))
        except ConnectionClosed:
            pass
        finally:
            end()
            telling.cancel()
            visitor.leave()


async def _tell(connection: ServerConnection, visitor: "Visitor", changed: asyncio.Event) -> None:
    """Send what has changed, whenever something has."""
    with contextlib.suppress(ConnectionClosed):
        while True:
            for message in await asyncio.to_thread(visitor.news):
                await connection.send(json.dumps(message))
            await changed.wait()
            await asyncio.sleep(TOGETHER_S)
            changed.clear()


class Visitor:
    """One open page."""

    def __init__(self, page: QueuePage, is_there: Callable[[], bool]) -> None:
        self._page, self._trials, self._is_there = page, page.trials, is_there
        self._name = self._browser = ""
        self._lock = threading.Lock()
        self._known: dict[TrialPlace, tuple[Row, Message]] = {}  # what the page has been told
        self._live: Message = {}

    def news(self) -> list[Message]:
        """What the page does not know yet: all at first, then the rows that are others now."""
        with self._lock:
            before = self._known
            self._known = rows = {}
            for row in self._trials.rows():
                place = (row.subject, row.trial)
                known = before.get(place)
                rows[place] = known if known and known[0] is row else (row, row_words(row))
            live, self._live = self._live, self._live_words()
            messages = [self._live] if live != self._live else []
            if not before:
                subjects = self._trials.subjects
                first = {
                    "rows": [words for _, words in rows.values()],
                    "several": subjects.several,
                    "formats": formats(),
                }
                about = {"root": subjects.root.path.name, "notes": list(subjects.root.notes)}
                return [{"kind": "rows", "suggested": self._page._login, **first, **about}, *messages]
            changed = [
                found[1]
                for place, found in rows.items()
                if place not in before or (found is not before[place] and found[1] != before[place][1])
            ]
            gone = [list(place) for place in before if place not in rows]
            if changed or gone:
                messages.append({"kind": "changed", "rows": changed, "gone": gone})
            return messages

    def leave(self) -> None:
        """The page has closed: its filter holds no more."""
        if self._trials.orders.pop(self._browser, None) is not None:
            self._trials.people.queue_changed()

    def answer(self, asked: Asked) -> Sequence[Message]:
        """Do what is wanted; what fails is told."""
        try:
            return self._answered(asked)
        except (SolverError, ReviewError) as error:
            return [{"kind": "told", "bad": True, "text": str(error)}]
        except Exception as error:  # whatever it is, a person should see it
            log_error("What was asked for in the queue", error)
            return [{"kind": "told", "bad": True, "text": f"That failed: {error or type(error).__name__}"}]

    def _answered(self, asked: Asked) -> Sequence[Message]:
        batches = self._page.batches
        match asked.what:
            case "hello":
                self._name = asked.text.strip()
                return []
            case "order":
                self._order(asked)
                return []
            case "anew":
                self._trials.rows(anew=True)
                self._trials.people.queue_changed()
                return []
            case "people":
                return [self._people()]
            case "comments":
                return [self._comments(asked)]
        if not self._name:
            raise ReviewError("say your name first; it stands by what you do")
        match asked.what:
            case "cancel":
                batches.cancel()
                return []
            case "assign":
                batches.assign(asked.places, asked.text, self._name, self._is_there)
                return []
            case "comment" | "settle":
                return self._say(asked)
        kind = {"fit": FIT, "diagnose": DIAGNOSE, "export": EXPORT}[asked.what]
        count = batches.start(kind, asked.places, self._name, asked.text)
        return [{"kind": "told", "bad": False, "text": f"{counted(count, 'subject')} in line."}]

    def _order(self, asked: Asked) -> None:
        """From now on T goes through these trials, in this order, in this browser; a page has one of each."""
        if not asked.text:
            return
        if asked.text != self._browser:
            self.leave()
            self._browser = asked.text
        known = {(row.subject, row.trial) for row in self._trials.rows()}
        places = tuple(place for place in dict.fromkeys(asked.places) if place in known)
        if self._trials.orders.get(asked.text) != places:
            self._trials.orders[asked.text] = places
            self._trials.people.queue_changed()

    def _say(self, asked: Asked) -> list[Message]:
        (subject, trial), number = self._place(asked), asked.number
        if asked.what == "comment":
            event: Comment | Settle = Comment(asked.text, None if number else asked.frame, number)
        else:
            event = Settle(number or 0, asked.text != "open")
        self._page.batches.say(subject, [trial], event, self._name)
        comments = self._comments_of(subject, trial)
        answered = next(
            (thread for thread in comments if isinstance(event, Comment) and thread.number == number), None
        )
        if answered is not None:
            self._trials.people.tell_of_answer(answered, trial, self._name, asked.text)
        return [comments_words((subject, trial), comments)]

    def _comments(self, asked: Asked) -> Message:
        subject, trial = self._place(asked)
        return comments_words((subject, trial), self._comments_of(subject, trial))

    def _comments_of(self, subject: str, trial: str) -> tuple[CommentThread, ...]:
        row = next(row for row in self._trials.rows() if (row.subject, row.trial) == (subject, trial))
        items: tuple[WorkItem, ...] = ()
        if row.comments:
            with open_log(self._trials.subjects.folders(subject)[0]) as log:
                items = log.work.reading()[0]
        return work_of([item for item in items if item.trial == trial]).comments

    def _place(self, asked: Asked) -> tuple[str, str]:
        known = {(row.subject, row.trial) for row in self._trials.rows() if row.trial}
        if len(asked.places) != 1 or asked.places[0] not in known:
            raise ReviewError("there is no such trial any more; look again")
        return asked.places[0]

    def _people(self) -> Message:
        """Who has done how much, and how far they agree."""
        rows = self._trials.rows()
        subjects = {name: self._trials.subjects.read(name) for name in seen_by_two(rows)}
        return {
            "kind": "people",
            "hoursLeft": hours_left(rows),
            "people": [{**asdict(share), "anHour": share.an_hour} for share in shares(rows)],
            "pairs": [asdict(pair) for pair in pairs(rows, subjects)],
        }

    def _live_words(self) -> Message:
        """Who is where, and what is at work."""
        trials = self._trials
        return {
            "kind": "live",
            "present": sorted(trials.people.names),
            "here": [[*place, list(names)] for place, names in sorted(trials.people.everywhere().items())],
            "work": dict(trials.tasks()),
            "batches": batch_words(self._page.batches.states),
        }
