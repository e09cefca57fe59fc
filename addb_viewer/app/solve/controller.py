"""Solving again from one browser, and comparing what came of it."""

from typing import Any

import numpy as np
import viser

from addb_viewer.app.jobs.job_queue import Progress, Task
from addb_viewer.app.jobs.progress_html import progress_html
from addb_viewer.app.jobs.stored_solves import Solve, solves
from addb_viewer.app.jobs.worker_process import Outcome
from addb_viewer.app.page.handles import put
from addb_viewer.app.page.notices import Notices
from addb_viewer.app.page.screen import Place
from addb_viewer.app.solve.comparison import compared
from addb_viewer.app.solve.html import (
    comparison_html,
    history_html,
    settings_html,
    solve_words,
    verdict_html,
)
from addb_viewer.app.solve.panel import BEFORE, SolvePanel
from addb_viewer.app.style.html_pieces import boxed
from addb_viewer.app.subjects.shared_subject import SOLVING, WITHHOLDING, SubjectRoom
from addb_viewer.app.trial.forces_in_use import mask_now
from addb_viewer.app.trial.replay import Replay
from addb_viewer.jobs.solving import job_for
from solver.errors import SolverError
from solver.pipeline import can_resolve
from solver.settings import Settings, as_dict, from_dict


class SolveDesk:
    """What one reviewer sees of the subject's solves."""

    def __init__(self, place: Place, panel: SolvePanel, notices: Notices) -> None:
        self.place, self.panel, self.notices = place, panel, notices
        self.comparing = False
        self._listed: dict[str, Solve] = {}

    @property
    def other(self) -> Replay | None:
        """The trial on the screen as the solve that is compared with has it; None: nothing is compared."""
        library, replay = self.place.room.other, self.place.replay
        if not self.comparing or library is None or replay is None:
            return None
        found = library.replay(replay.name)
        return found if found.bodies is not None and found.frames == replay.frames else None

    def solve(self) -> None:
        """G: nothing is done where nothing would come out otherwise."""
        author = self.place.author()
        if nothing_to_solve(self.place.room):
            self.notices.tell(
                "Nothing to solve", "The same forces count, from the same files, as in the fit on the screen."
            )
            return
        self.place.room.solve(author)

    def cancel(self) -> None:
        """End what is at work."""
        stop(self.place)

    def withhold(self) -> None:
        """Judge the fit on the screen on the layouts of withheld forces that are left."""
        self.place.room.withhold()

    def keep(self) -> None:
        """The new solve becomes the subject's fit."""
        self.place.room.keep(self.place.author())
        self.notices.tell("Kept", "The solve on the screen is the subject's fit now.")

    def discard(self) -> None:
        """The fit before stays."""
        room, author = self.place.room, self.place.author()
        if room.new is None or room.new.by == author:
            self._discard(author, None)
            return
        solve, by = room.new, room.new.by
        self.place.questions.ask(
            f"Discard {by}'s solve {solve.number}?",
            [
                f"{by} has not decided about it. It is of {solve.when.astimezone():%d %b %H:%M}.",
                f"It stays in the list of solves, and {by} is told.",
            ],
            "Discard",
            lambda: self._discard(author, solve.number),
        )

    def toggle(self) -> None:
        """M."""
        self.compare(not self.comparing)

    def compare(self, on: bool) -> None:
        """Show the other solve in scene and charts, or no longer.

        Raises:
            SolverError: there is no other solve.
        """
        if on and self.place.room.other is None:
            put(self.panel.compare, False)
            self.comparing = self._before()
            return
        self.comparing = on
        self.show()

    def choose(self) -> None:
        """Compare with the chosen solve."""
        solve = self._listed.get(str(self.panel.other.value))
        self.comparing = True
        if solve is None:
            self.comparing = self._before()
        else:
            self.place.room.compare_with(solve)

    def show(self) -> None:
        """Put solves, what waits and what changed on the screen."""
        room, panel, replay = self.place.room, self.panel, self.place.replay
        made = solves(room.results)
        shown = room.new.number if room.new is not None else next(
            (s.number for s in reversed(made) if s.state == "kept"), None
        )  # fmt: skip
        self._listed = {solve_words(s): s for s in reversed(made) if s.number != shown}
        if panel.other.options != (BEFORE, *self._listed):
            panel.other.options = (BEFORE, *self._listed)
        waits = room.new is not None
        panel.keep.visible = panel.discard.visible = panel.verdict.visible = waits
        if room.new is not None:
            panel.verdict.content = verdict_html(room.new, room.behind)
        self._progress(room.bench.progress)
        self.comparing = self.comparing and room.other is not None
        put(panel.compare, self.comparing)
        panel.history.content = history_html(made, replay.name if replay else "")
        if room.library.fit is not None:
            panel.settings.content = settings_html(
                as_dict(from_dict(room.library.fit.settings)), as_dict(Settings())
            )
        panel.changed.content = self._changed()

    def progressed(self, progress: Progress) -> None:
        """Something is at work."""
        self._progress(progress)

    def ended(self, task: Task, outcome: Outcome) -> None:
        """Nothing is any more."""
        self._progress(None)
        if task.doing == WITHHOLDING and not (outcome.succeeded or outcome.cancelled):
            self.notices.failed(WITHHOLDING, outcome.error or "it ended without a word")
        if task.doing != SOLVING:
            return
        if outcome.cancelled:
            self.notices.tell("Cancelled", "Solving was cancelled; the fit is as it was.", "gray")
        elif not outcome.succeeded:
            self.notices.failed("Solving", outcome.error or "it ended without a word")
            return
        room = self.place.room
        self.comparing = room.other is not None
        if room.new is None:
            self.notices.tell("Fitted", "The subject's first fit is kept and on the screen.")
        elif room.new.by != task.by:
            self.notices.tell(
                "Solved",
                f"The solve for {task.by} waits until {room.new.by}'s is kept or discarded.",
            )
        else:
            self.notices.tell("Solved", "The new solve is on the screen; keep it or discard it.")

    def _discard(self, author: str, number: int | None) -> None:
        self.place.room.discard(author, number)
        self.notices.tell("Discarded", "The subject's fit is as it was.")

    def _before(self) -> bool:
        """Put the fit before beside the one on the screen.

        Raises:
            SolverError: there is none.
        """
        room = self.place.room
        earlier = next(iter(self._listed.values()), None)
        if room.new is None and earlier is None:
            raise SolverError("there is no other solve to compare with; G solves again")
        room.compare_with(None if room.new is not None else earlier)
        return True

    def _changed(self) -> str:
        replay, other, room = self.place.replay, self.other, self.place.room
        if replay is None or other is None or room.other is None:
            return boxed("Nothing is compared. M compares with the solve before.")
        found = compared(other, replay, room.other.figures(replay.name), room.library.figures(replay.name))
        return comparison_html(found, "before")

    def _progress(self, progress: Progress | None) -> None:
        panel, busy = self.panel, progress is not None
        panel.cancel.visible = panel.bar.visible = panel.status.visible = busy
        panel.withhold.visible = not busy and self.place.room.withholding_due
        if progress is not None:
            show_progress(panel.bar, panel.status, progress)


def stop(place: Place) -> None:
    """End what is at work for this person, else forget what waits for them, else ask about another's."""
    room, author, progress = place.room, place.author(), place.room.bench.progress
    by = "" if progress is None else progress.task.by
    if progress is None or by in ("", author):
        room.cancel(author)
        return
    dropped = room.bench.drop(author)
    if dropped is not None:
        place.notices.tell("Cancelled", f"{dropped.doing} does not wait any more.", "gray")
        return
    place.questions.ask(
        f"Cancel what {by} has asked for?",
        [f"{progress.task.doing} for {by} is at work. Nothing of it stays, and {by} is told."],
        "Cancel it",
        lambda: room.cancel(author) if room.bench.task is progress.task else None,
    )


def nothing_to_solve(room: SubjectRoom) -> bool:
    """Whether a solve would only find the fit on the screen again: files, settings and masks are the same.

    Args:
        room: of the subject.

    Raises:
        SolverError: the subject's files cannot be read.
    """
    library = room.library
    fit = library.fit
    if fit is None or fit.heldout_due:
        return False
    for trial in fit.trials:
        name, used = trial.capture.name, trial.mask
        now = mask_now(library.replay(name), room.book.review(name)) if used is not None else None
        if used is not None and (now is None or not np.array_equal(now.counts, used.counts)):
            return False
    job = job_for(room.subject.folder, out=room.results)
    return can_resolve(fit, job.subject, job.subject.trials, job.settings, extension=job.extension)


def show_progress(bar: Any, status: viser.GuiHtmlHandle, progress: Progress) -> None:
    """Fill a bar, moving where the work does not say how far it is, and write what it does."""
    known = progress.fraction is not None
    bar.animated = not known
    bar.value = 100.0 * progress.fraction if progress.fraction is not None else 100.0
    status.content = progress_html(progress)
