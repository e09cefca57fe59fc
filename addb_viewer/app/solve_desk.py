"""Solving again from one browser, and comparing what came of it."""

from typing import Any

import viser

from addb_viewer.app.comparison import compared
from addb_viewer.app.handles import put
from addb_viewer.app.notices import Notices
from addb_viewer.app.page import boxed
from addb_viewer.app.place import Place
from addb_viewer.app.progress_html import progress_html
from addb_viewer.app.replay import Replay
from addb_viewer.app.room import SOLVING
from addb_viewer.app.solve_html import comparison_html, history_html, settings_html, solve_words
from addb_viewer.app.solve_panel import BEFORE, SolvePanel
from addb_viewer.app.solves import Solve, solves
from addb_viewer.app.work import Outcome
from addb_viewer.app.workbench import Progress, Task
from solver.errors import SolverError
from solver.settings import Settings, as_dict


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
        """G."""
        self.place.room.solve(self.place.author())

    def cancel(self) -> None:
        """End what is at work."""
        self.place.room.bench.cancel()

    def keep(self) -> None:
        """The new solve becomes the subject's fit."""
        self.place.author()
        self.place.room.keep()
        self.notices.tell("Kept", "The solve on the screen is the subject's fit now.")

    def discard(self) -> None:
        """The fit before stays."""
        self.place.author()
        self.place.room.discard()
        self.notices.tell("Discarded", "The subject's fit is as it was.")

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
        waiting = room.new is not None
        panel.keep.visible = panel.discard.visible = panel.verdict.visible = waiting
        if room.new is not None:
            panel.verdict.content = boxed(
                "<b>A new solve is on the screen.</b> Keep it or discard it; "
                "M compares it with the one before."
            )
        self._progress(room.bench.progress)
        self.comparing = self.comparing and room.other is not None
        put(panel.compare, self.comparing)
        panel.history.content = history_html(made, replay.name if replay else "")
        if room.library.fit is not None:
            panel.settings.content = settings_html(room.library.fit.settings, as_dict(Settings()))
        panel.changed.content = self._changed()

    def progressed(self, progress: Progress) -> None:
        """Something is at work."""
        self._progress(progress)

    def ended(self, task: Task, outcome: Outcome) -> None:
        """Nothing is any more."""
        self._progress(None)
        if task.doing != SOLVING:
            return
        if outcome.cancelled:
            self.notices.tell("Cancelled", "Solving was cancelled; the fit is as it was.", "gray")
        elif not outcome.succeeded:
            self.notices.failed("Solving", outcome.error or "it ended without a word")
        else:
            self.comparing = self.place.room.other is not None
            self.notices.tell("Solved", "The new solve is on the screen; keep it or discard it.")

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
        panel.solve.visible = not busy
        if progress is not None:
            show_progress(panel.bar, panel.status, progress)


def show_progress(bar: Any, status: viser.GuiHtmlHandle, progress: Progress) -> None:
    """Fill a bar, moving where the work does not say how far it is, and write what it does."""
    known = progress.fraction is not None
    bar.animated = not known
    bar.value = 100.0 * progress.fraction if progress.fraction is not None else 100.0
    status.content = progress_html(progress)
