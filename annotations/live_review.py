"""A subject's review in memory, kept up with what any program records: what an app shows to its browsers.

Edits of a log whose file is gone are put into a new file beside it.
"""

import sqlite3
import threading
import time
from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, TypeVar
from urllib.parse import quote

from annotations.events import Edit, Event
from annotations.log import ReviewLog, review_of
from annotations.reading import Reading, UnreadableRow, listed
from annotations.review_errors import LostLogError, ReviewError
from annotations.trial_review import TrialReview

_LOOKS = 4  # another program may be moving edits into the file during the first ones
_BETWEEN_S = 0.05  # [s] likewise; a move writes without pause, so that it shows in the file's time

_Written = TypeVar("_Written")


class LiveReview:
    """All edits of a subject, and the states folded from them, each trial's once for every new edit.

    Several threads may share one; each reader remembers for itself which revision it has seen. Where the
    log's file is replaced, deleted or written over meanwhile, all that is in memory is put into a new file
    beside it, and nothing is recorded any more.
    """

    def __init__(self, log: ReviewLog, feet: Sequence[str]) -> None:
        """Read the log.

        Args:
            log: the subject's.
            feet: names of its foot bodies.
        """
        self.log = log
        self._feet = tuple(feet)
        self._lock = threading.Lock()
        self._edits: list[Edit] = []
        self._unreadable: list[UnreadableRow] = []
        self._seen = 0
        self._states: dict[tuple[str, str | None], tuple[tuple[int, int], TrialReview]] = {}
        self._lost = ""
        self._take(log.reading())
        self._file = None if log.file is None else _KeptFile(log.file)

    @property
    def revision(self) -> int:
        """The number of the last row that was seen, whether it can be read or not; 0 where there is none."""
        with self._lock:
            return self._seen

    def refresh(self) -> int:
        """Fetch what has been recorded since, here or by another program.

        Returns:
            The revision now in memory.

        Raises:
            LostLogError: its file is not the one that was opened any more.
            ReviewError: the log cannot be read.
        """
        with self._lock:
            self._read(())
            return self._seen

    def record(self, trial: str, author: str, event: Event | None, write: Callable[[], _Written]) -> _Written:
        """Record an edit, and be sure that it is in the file that lies on the disk now.

        Args:
            trial: its name.
            author: who makes the edit.
            event: what it says; None where `write` is going to say that there is nothing to do.
            write: records it in the log.

        Returns:
            What `write` returns.

        Raises:
            LostLogError: the file is not the one that was opened any more. The first time, the edit is in the
                file that the message names.
            ReviewError: `write` says so.
        """
        with self._lock:
            number, now = self._seen + 1, datetime.now(UTC)
            asked = () if event is None else (Edit(number, trial, author, now, event),)
            self._stop_if_lost(asked)
            try:
                written = write()
            except ReviewError:
                self._stop_if_lost(asked)
                raise
            self._read(asked)
            return written

    def since(self, revision: int, trial: str | None = None) -> tuple[Edit, ...]:
        """The edits after a revision, from memory.

        Args:
            revision: what the reader has seen.
            trial: of this trial only.
        """
        with self._lock:
            new = self._edits
            if new and new[0].number <= revision:
                new = new[bisect_right(new, revision, key=lambda edit: edit.number) :]
            return tuple(edit for edit in new if trial is None or edit.trial == trial)

    def history(self, trial: str) -> tuple[Edit, ...]:
        """The edits of a trial, in order."""
        return self.since(0, trial)

    def unreadable(self, trial: str | None = None) -> tuple[UnreadableRow, ...]:
        """The rows that are passed over; those that may be about a trial, or all."""
        with self._lock:
            return tuple(row for row in self._unreadable if trial is None or row.may_be_about(trial))

    def review(self, trial: str, by: str | None = None) -> TrialReview:
        """The present state of a trial's review.

        Args:
            trial: its name.
            by: this reviewer's opinion alone; None for everybody's.

        Raises:
            ReviewError: an edit is about a foot that the subject does not have.
        """
        edits, unreadable = self.history(trial), self.unreadable(trial)
        made_from = (edits[-1].number if edits else 0, len(unreadable))
        kept = self._states.get((trial, by))
        if kept is None or kept[0] != made_from:
            kept = (made_from, review_of(trial, edits, unreadable, self._feet, by))
            self._states[trial, by] = kept
        return kept[1]

    def reviews(self) -> Mapping[str, TrialReview]:
        """The present state of every trial that has edits, or rows that cannot be read."""
        found = {edit.trial for edit in self.since(0)} | {row.trial for row in self.unreadable() if row.trial}
        return {trial: self.review(trial) for trial in sorted(found)}

    def _read(self, asked: Sequence[Edit]) -> None:
        """Fetch new edits; what was read from a file of others is not taken."""
        self._stop_if_lost(asked)
        try:
            new = self.log.reading(after=self._seen)
        except ReviewError:
            self._stop_if_lost(asked)
            raise
        self._stop_if_lost(asked)
        self._take(new)

    def _take(self, new: Reading) -> None:
        self._edits.extend(new.edits)
        self._unreadable.extend(new.unreadable)
        self._seen = max(self._seen, new.last)

    def _stop_if_lost(self, asked: Sequence[Edit]) -> None:
        if self._file is not None and self.log.file is not None and not self._lost:
            loss = self._file.loss()
            if loss:
                self._lost = rescued(self.log.file, loss, self._edits, asked, self._unreadable)
        if self._lost:
            raise LostLogError(self._lost)


def rescued(
    file: Path,
    loss: str,
    known: Sequence[Edit],
    asked: Sequence[Edit],
    unreadable: Sequence[UnreadableRow] = (),
) -> str:
    """Write edits into a file that is not there yet, whole and ready to take the lost one's place.

    Args:
        file: that is lost.
        loss: what happened to it, as a clause.
        known: all edits of its subject that are known.
        asked: the one that was to be recorded, if any.
        unreadable: rows of the lost file that nobody could read; they are named.

    Returns:
        Words for people: what happened, where the edits are, what to do.

    Raises:
        ReviewError: they cannot be written; they are in memory alone.
    """
    now = datetime.now(UTC)
    place = file.with_name(f"{file.stem}.rescued-{now:%Y-%m-%dT%H-%M-%S.%f}Z{file.suffix}")
    try:
        with ReviewLog.open(place) as log:
            log.take_over((*known, *asked))
    except ReviewError as error:
        for left in ("", "-wal", "-shm"):
            with suppress(OSError):
                place.with_name(f"{place.name}{left}").unlink()
        raise ReviewError(
            f"{file}: {loss}. Nothing is recorded now. The {len(known)} edits so far are only in memory, "
            f"because they cannot be written beside it ({error}). Leave the app open, make room there or "
            "make the folder writable again, and repeat the edit"
        ) from error
    with_it = ", with the one that was being made," if asked else ""
    without = f" Not in it, because they cannot be read: {listed(unreadable)}." if unreadable else ""
    return (
        f"{file}: {loss}. Nothing is recorded any more. All {len(known) + len(asked)} edits that were known "
        f"here{with_it} are in {place.name} beside it.{without} Close the app; then put the right file in "
        f"place, or rename {place.name} to {file.name}, remove {file.name}-wal and {file.name}-shm if they "
        "are there, and open the subject again"
    )


@dataclass(frozen=True)
class _Last:
    """The last edit in the file itself; those of the write-ahead log come later."""

    number: int
    made_at: Any  # as it lies there


class _KeptFile:
    """Looks at one SQLite file from outside its connections, which stay with the file that they opened.

    A file put in its place is another one by device and inode. One that was written over stays the same by
    these; but nothing is ever removed from a log, so the last edit that was once in it has to be in it still.
    """

    def __init__(self, path: Path) -> None:
        """Remember what is there now, while a connection holds it open."""
        self._path = path
        self._side = path.with_name(f"{path.name}-wal")
        self._whose = (_identity(path), _identity(self._side))
        self._state = _state(path)
        self._last: _Last | None = None
        _, self._last = self._held()

    def loss(self) -> str:
        """What has happened to the file, as a clause; empty where it is as it should be."""
        if _identity(self._path) is None:
            return "the file was deleted or moved away while it was open"
        if (_identity(self._path), _identity(self._side)) != self._whose:
            return "another file was put in its place while it was open"
        if _state(self._path) == self._state:
            return ""
        is_settled = False
        for look in range(_LOOKS):
            if look:
                time.sleep(_BETWEEN_S)
            state = _state(self._path)
            is_whole, last = self._held()
            is_settled = state == _state(self._path)
            if is_settled and is_whole:
                self._state, self._last = state, last
                return ""
        return "it was overwritten with an older or another copy while it was open" if is_settled else ""

    def _held(self) -> tuple[bool, _Last | None]:
        """Whether the edit that was the last one is still in the file; and the one that is now."""
        try:
            return self._last is None or self._has(self._last), self._read_last()
        except sqlite3.DatabaseError:
            return False, None

    def _has(self, last: _Last) -> bool:
        found = self._ask("SELECT made_at FROM edits WHERE number = ?", last.number)
        return found == (last.made_at,)

    def _read_last(self) -> _Last | None:
        if self._ask("SELECT 1 FROM sqlite_master WHERE name = 'edits'") is None:
            return None
        found = self._ask("SELECT number, made_at FROM edits ORDER BY number DESC LIMIT 1")
        return None if found is None else _Last(*found)

    def _ask(self, question: str, *values: int) -> tuple[Any, ...] | None:
        """Ask the file alone, without its write-ahead log."""
        name = f"file:{quote(str(self._path.absolute()))}?mode=ro&immutable=1"
        connection = sqlite3.connect(name, uri=True)
        connection.text_factory = bytes  # compared, not read: it may be no text at all
        try:
            found: tuple[Any, ...] | None = connection.execute(question, values).fetchone()
            return found
        finally:
            connection.close()


def _identity(path: Path) -> tuple[int, int] | None:
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_dev, found.st_ino


def _state(path: Path) -> tuple[int, int] | None:
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size
