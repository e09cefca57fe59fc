"""A subject's review as all its browsers see it: edits go to the store first, and everybody's are noticed."""

import threading
from collections.abc import Callable, Sequence
from contextlib import suppress

from addb_viewer.jobs.review_store import has_log, open_log, record, unreadable_notes, with_own_file
from annotations.events import Edit, Event, Redo, Undo
from annotations.folding import folded
from annotations.live_review import LiveReview
from annotations.review_errors import ReviewError
from annotations.trial_review import TrialReview
from annotations.undoing import next_redo, next_undo
from annotations.work import TrialWork, WorkEvent, work_of
from solver.capture.capture import Capture, Subject, TrialFiles

LOOK_EVERY = 0.4  # [s] between two looks at what other programs recorded


class SubjectReview:
    """All edits of one subject. Its file is made with the first edit: looking writes nothing."""

    def __init__(
        self,
        subject: Subject,
        capture: Callable[[str], Capture],
        edited: Callable[[Sequence[Edit]], None],
        failed: Callable[[Exception], None],
    ) -> None:
        """Begin to look for edits.

        Args:
            subject: whose.
            capture: a trial as read from its files.
            edited: told of new edits, by whomever, once each and in order; of none where there is a new row
                that cannot be read, an assignment or a comment.
            failed: told when the log, or a new row of it, cannot be read.
        """
        self.subject, self._capture, self._edited, self._failed = subject, capture, edited, failed
        self._lock = threading.RLock()
        self._live: LiveReview | None = None
        self._told, self._passed_over, self._told_work = 0, 0, 0
        self._stop = threading.Event()
        self._open_if_there()
        if self._live is not None:
            self._told, self._passed_over = self._live.revision, len(self._live.unreadable())
            self._told_work = self._live.log.work.revision()
        self._thread = threading.Thread(target=self._look, name=f"review of {subject.name}", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop looking, and let go of the database."""
        self._stop.set()
        if self._thread is not threading.current_thread():
            self._thread.join(timeout=5.0)
        with self._lock:
            if self._live is not None:
                self._live.log.close()
                self._live = None

    def review(self, trial: str) -> TrialReview:
        """The present state of a trial's review; before the first edit, that of its review.json."""
        with self._lock:
            unreadable = () if self._live is None else self._live.unreadable(trial)
            if self._live is not None and self._live.history(trial):
                return self._live.review(trial)
        return folded(trial, self._imported(trial), self.subject.foot_bodies, unreadable)

    def before(self, trial: str, edit: int) -> TrialReview:
        """The state of a trial's review before an edit of that number."""
        earlier = [e for e in self.history(trial) if e.number < edit] or self._imported(trial)
        return folded(trial, earlier, self.subject.foot_bodies)

    def history(self, trial: str) -> tuple[Edit, ...]:
        """The trial's edits in order."""
        with self._lock:
            return () if self._live is None else self._live.history(trial)

    def record(self, trial: str, event: Event, author: str) -> Edit:
        """Record an edit; it is on the disk, and everybody has heard of it, when this returns.

        Raises:
            ReviewError: it cannot be recorded.
            CaptureError: the trial's files cannot be read.
        """
        files, capture = self._files(trial), self._capture(trial)
        with self._lock:
            live = self._opened()
            number = live.record(
                trial, author, event, lambda: record(live.log, files, capture, event, author)
            )
        self._tell()
        return next(edit for edit in live.history(trial) if edit.number == number)

    def work(self, trial: str) -> TrialWork:
        """Who is to review a trial, and the comments on it."""
        with self._lock:
            items = () if self._live is None else self._live.log.work.reading()[0]
        return work_of([item for item in items if item.trial == trial])

    def say(self, trial: str, event: WorkEvent, author: str) -> None:
        """Record an assignment, a comment, or that one is settled; on the disk when this returns.

        Raises:
            ReviewError: it cannot be recorded.
        """
        self._opened().log.work.append([trial], event, author)
        self._tell()

    def undo(self, trial: str, author: str) -> Edit:
        """Take back the author's last edit of the trial; returns that edit.

        Raises:
            ReviewError: there is none.
        """
        live = self._opened()
        event = None
        with suppress(ReviewError):  # the log itself says that there is nothing
            event = Undo(next_undo(live.history(trial), author, live.unreadable(trial)).number)
        undone = live.record(trial, author, event, lambda: live.log.undo(trial, author))
        self._tell()
        return undone

    def redo(self, trial: str, author: str) -> Edit:
        """Let the edit that the author undid last count again; returns that edit.

        Raises:
            ReviewError: there is none.
        """
        live = self._opened()
        event = None
        with suppress(ReviewError):
            event = Redo(next_redo(live.history(trial), author, live.unreadable(trial)).number)
        redone = live.record(trial, author, event, lambda: live.log.redo(trial, author))
        self._tell()
        return redone

    def _opened(self) -> LiveReview:
        with self._lock:
            if self._live is None:
                self._live = LiveReview(open_log(self.subject.folder), self.subject.foot_bodies)
            return self._live

    def _open_if_there(self) -> None:
        if self._live is None and has_log(self.subject.folder):
            self._opened()

    def _look(self) -> None:
        failing = False
        while not self._stop.wait(LOOK_EVERY):
            try:
                self._open_if_there()
                self._tell()
                failing = False
            except Exception as error:  # told once, and tried again: a share may come back
                if not failing and not self._stop.is_set():
                    self._failed(error)
                failing = True

    def _tell(self) -> None:
        with self._lock:
            if self._live is None:
                return
            self._live.refresh()
            new = self._live.since(self._told)
            passed_over = self._live.unreadable()[self._passed_over :]
            self._told = self._live.revision
            self._passed_over += len(passed_over)
            before, self._told_work = self._told_work, self._live.log.work.revision()
            worked = self._told_work != before
        for note in unreadable_notes(passed_over):
            self._failed(ReviewError(note))
        if passed_over or worked:
            self._edited(())
        if new:
            self._edited(new)

    def _files(self, trial: str) -> TrialFiles:
        return next(files for files in self.subject.trials if files.name == trial)

    def _imported(self, trial: str) -> tuple[Edit, ...]:
        """A review.json that is not in the log yet."""
        files = next((files for files in self.subject.trials if files.name == trial), None)
        return with_own_file(files, self._capture(trial), ()) if files and files.has_review else ()
