"""Solving again from one browser, and comparing what came of it."""

import html
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import viser

from addb_viewer.app.jobs.job_queue import Outcome, Task
from addb_viewer.app.page.handles import put
from addb_viewer.app.page.notices import Notices
from addb_viewer.app.page.screen import Screen
from addb_viewer.app.solve.comparison import Comparison, compared, got_worse
from addb_viewer.app.subjects.shared_subject import SOLVING, SharedSubject
from addb_viewer.jobs.solving import job_for
from addb_viewer.jobs.stored_solves import DISCARDED, KEPT, NEW, REPLACED, Solve, stored_solves
from addb_viewer.text.coordinate_words import torque_in_words
from addb_viewer.trial_view.forces_in_use import mask_now
from addb_viewer.trial_view.html_pieces import boxed, clickable, table
from addb_viewer.trial_view.replay import ForceUse, Replay
from solver.common.errors import SolverError
from solver.fitting.pipeline import can_resolve
from solver.fitting.settings import Settings, as_dict, by_name, from_dict

BEFORE = "the fit before"  # the kept one while a new one waits, else the last one that was replaced
TEN = 10.0  # from which on a number has its two digits before the point
_STATES = {
    NEW: "new: keep it or discard it",
    KEPT: "the subject's fit",
    DISCARDED: "discarded",
    REPLACED: "kept before",
}


class SolvePanel:
    """Handles of the panel."""

    def __init__(self, gui: viser.GuiApi, tab: viser.GuiTabHandle) -> None:
        """Lay out the panel; nothing is bound to anything yet."""
        with tab:
            self.solve = gui.add_button(
                "Solve again", icon=viser.Icon.REFRESH, hint="With the present flags and decisions; key G"
            )
            self.verdict = gui.add_html("", visible=False)
            self.keep = gui.add_button(
                "Keep", icon=viser.Icon.CHECK, visible=False, hint="It becomes the subject's fit"
            )
            self.discard = gui.add_button(
                "Discard", icon=viser.Icon.TRASH, visible=False, color="gray", hint="The fit before stays"
            )
            with gui.add_folder("What changed"):
                self.compare = gui.add_checkbox(
                    "Compare", False, hint="Key M: the other solve in scene and charts"
                )
                self.other = gui.add_dropdown("Compare with", (BEFORE,))
                self.changed = gui.add_html("")
            with gui.add_folder("Solves"):
                self.history = gui.add_html("")
                self.settings = gui.add_html("")


class SolveController:
    """What one reviewer sees of the subject's solves."""

    def __init__(self, screen: Screen, panel: SolvePanel, notices: Notices) -> None:
        self.screen, self.panel, self.notices = screen, panel, notices
        self.comparing = False
        self._listed: dict[str, Solve] = {}

    @property
    def other(self) -> Replay | None:
        """The trial on the screen as the solve that is compared with has it; None: nothing is compared."""
        library, replay = self.screen.shared.fits.compared, self.screen.replay
        if not self.comparing or library is None or replay is None:
            return None
        found = library.replay(replay.name)
        return found if found.bodies is not None and found.frames == replay.frames else None

    def solve(self) -> None:
        """G: nothing is done where nothing would come out otherwise."""
        author = self.screen.reviewer.author()
        if nothing_to_solve(self.screen.shared):
            self.notices.tell(
                "Nothing to solve", "The same forces count, from the same files, as in the fit on the screen."
            )
            return
        self.screen.shared.solve(author)

    def cancel(self) -> None:
        """End what is at work."""
        stop(self.screen)

    def keep(self) -> None:
        """The new solve becomes the subject's fit."""
        self.screen.shared.keep(self.screen.reviewer.author())
        self.notices.tell("Kept", "The solve on the screen is the subject's fit now.")

    def discard(self) -> None:
        """The fit before stays."""
        shared, author = self.screen.shared, self.screen.reviewer.author()
        if shared.fits.new is None or shared.fits.new.by == author:
            self._discard(author, None)
            return
        solve, by = shared.fits.new, shared.fits.new.by
        self.screen.questions.ask(
            f"Discard {by}'s solve {solve.number}?",
            [
                f"{by} has not decided about it. It is of {solve.when.astimezone():%d %b %H:%M}.",
                f"It stays in the list of solves, and {by} is told.",
            ],
            "Discard",
            lambda: self._discard(author, solve.number),
        )

    @property
    def worse(self) -> tuple[str, ...]:
        """What the new solve made worse in the trial on the screen; nothing where none waits."""
        fits, replay = self.screen.shared.fits, self.screen.replay
        if fits.new is None or fits.compared is None or replay is None:
            return ()
        before, now = fits.compared, fits.shown
        if replay.name not in before.trials:
            return ()
        was = before.replay(replay.name)
        return got_worse(was, replay, before.figures(replay.name), now.figures(replay.name))

    def decide(self) -> None:
        """Y: the new solve is kept, unless it is worse."""
        (self.discard if self.worse else self.keep)()

    def toggle(self) -> None:
        """M."""
        self.compare(not self.comparing)

    def compare(self, on: bool) -> None:
        """Show the other solve in scene and charts, or no longer.

        Raises:
            SolverError: there is no other solve.
        """
        if on and self.screen.shared.fits.compared is None:
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
            self.screen.shared.compare_with(solve)

    def show(self) -> None:
        """Put solves, what waits and what changed on the screen."""
        shared, panel, replay = self.screen.shared, self.panel, self.screen.replay
        made = stored_solves(shared.results)
        shown = shared.fits.new.number if shared.fits.new is not None else next(
            (s.number for s in reversed(made) if s.state == "kept"), None
        )  # fmt: skip
        self._listed = {solve_words(s): s for s in reversed(made) if s.number != shown}
        if panel.other.options != (BEFORE, *self._listed):
            panel.other.options = (BEFORE, *self._listed)
        waits = shared.fits.new is not None
        panel.keep.visible = panel.discard.visible = panel.verdict.visible = waits
        if shared.fits.new is not None:
            panel.verdict.content = verdict_html(shared.fits.new, shared.fits.behind)
        self.comparing = self.comparing and shared.fits.compared is not None
        put(panel.compare, self.comparing)
        panel.history.content = history_html(made, replay.name if replay else "")
        if shared.fits.shown.fit is not None:
            panel.settings.content = settings_html(
                as_dict(from_dict(shared.fits.shown.fit.settings)), as_dict(Settings())
            )
        panel.changed.content = self._changed()

    def ended(self, task: Task, outcome: Outcome) -> None:
        """Nothing is any more."""
        if task.doing != SOLVING:
            return
        if outcome.cancelled:
            self.notices.tell("Cancelled", "Solving was cancelled; the fit is as it was.", important=True)
        elif not outcome.succeeded:
            self.notices.failed("Solving", outcome.error or "it ended without a word")
            return
        shared = self.screen.shared
        self.comparing = shared.fits.compared is not None
        if shared.fits.new is None:
            self.notices.tell("Fitted", "The subject's first fit is kept and on the screen.")
        elif shared.fits.new.by != task.by:
            self.notices.tell(
                "Solved",
                f"The solve for {task.by} waits until {shared.fits.new.by}'s is kept or discarded.",
            )
        else:
            self.notices.tell("Solved", "The new solve is on the screen; keep it or discard it.")

    def _discard(self, author: str, number: int | None) -> None:
        self.screen.shared.discard(author, number)
        self.notices.tell("Discarded", "The subject's fit is as it was.")

    def _before(self) -> bool:
        """Put the fit before beside the one on the screen.

        Raises:
            SolverError: there is none.
        """
        shared = self.screen.shared
        earlier = next(iter(self._listed.values()), None)
        if shared.fits.new is None and earlier is None:
            raise SolverError("there is no other solve to compare with; G solves again")
        shared.compare_with(None if shared.fits.new is not None else earlier)
        return True

    def _changed(self) -> str:
        replay, other, shared = self.screen.replay, self.other, self.screen.shared
        if replay is None or other is None or shared.fits.compared is None:
            return boxed("Nothing is compared. M compares with the solve before.")
        found = compared(
            other, replay, shared.fits.compared.figures(replay.name), shared.fits.shown.figures(replay.name)
        )
        return comparison_html(found, "before")


def stop(screen: Screen) -> None:
    """End what is at work for this person, else forget what waits for them, else ask about another's."""
    shared, author, progress = screen.shared, screen.reviewer.author(), screen.shared.jobs.progress
    if progress is None or progress.task.by == author:
        shared.cancel(author)
        return
    by = progress.task.by
    dropped = shared.jobs.drop(author)
    if dropped is not None:
        screen.notices.tell("Cancelled", f"{dropped.doing} does not wait any more.", important=True)
        return
    screen.questions.ask(
        f"Cancel what {by} has asked for?",
        [f"{progress.task.doing} for {by} is at work. Nothing of it stays, and {by} is told."],
        "Cancel it",
        lambda: shared.cancel(author) if shared.jobs.task is progress.task else None,
    )


def nothing_to_solve(shared: SharedSubject) -> bool:
    """Whether a solve would only find the fit on the screen again: files, settings and masks are the same.

    Args:
        shared: of the subject.

    Raises:
        SolverError: the subject's files cannot be read.
    """
    library = shared.fits.shown
    fit = library.fit
    if fit is None or fit.held_out_due:
        return False
    least = from_dict(fit.settings).detection.confidence
    for trial in fit.trials:
        forces = ForceUse.of(trial.mask, trial.proposals, least)
        feet = () if trial.contacts is None else trial.contacts.foot_bodies
        now = mask_now(feet, forces, shared.reviews.review(trial.capture.name))
        if forces.counts is not None and (now is None or not np.array_equal(now.counts, forces.counts)):
            return False
    job = job_for(shared.subject.folder, out=shared.results)
    return can_resolve(fit, job.subject, job.subject.trials, job.settings, extension=job.extension)


def comparison_html(found: Comparison, before: str) -> str:
    """What changed in the trial on the screen.

    Args:
        found: of the two solves.
        before: what the other solve is called.
    """
    edited = ", ".join(f"{a}–{b - 1}" for a, b in found.edited) or "none"
    figures = table(
        [(label, unbroken(was), "→" if was != now else "=", unbroken(now)) for label, was, now in found.rows],
        head=("RMS", before, "", "now"),
    )
    torques = "".join(
        clickable(
            str(change.frame),
            f"<div style='padding:.05em .3em'>{html.escape(torque_in_words(change.name))}: "
            f"<b>{_two_digits(change.rms)} {change.unit}</b> RMS, "
            f"at most {_two_digits(change.largest, '+')} {change.unit} at frame {change.frame}</div>",
        )
        for change in found.torques
    )
    where = "near the edit" if found.edited else "over the trial"
    return boxed(
        f"{figures}<div style='margin-top:.4em'>Frames whose forces count differently: {edited}</div>"
        + (f"<div style='margin-top:.4em'><b>Joint torques that changed most {where}</b></div>{torques}")
        * bool(torques)
    )


def solve_words(solve: Solve) -> str:
    """A solve in a few words, as lists have it."""
    return f"{solve.number} · {solve.when.astimezone():%d %b %H:%M} · {solve.by}"


def verdict_html(new: Solve, behind: Sequence[Solve]) -> str:
    """What is to be decided.

    Args:
        new: on the screen.
        behind: those that wait for it.
    """
    after = "".join(f"<div>After it: {html.escape(solve_words(solve))}</div>" for solve in behind)
    return boxed(
        f"<b>A new solve is on the screen.</b> {html.escape(new.by)} asked for it. Keep it or discard it; "
        f"M compares it with the one before.{after}"
    )


def history_html(made: Sequence[Solve], trial: str) -> str:
    """The solves on the disk, newest first, with the figures of the trial on the screen."""
    if not made:
        return boxed("No solves of this app yet; the fit on the screen was made on the command line, if any.")
    rows = []
    for solve in reversed(made):
        figures = solve.figures.trial(trial)
        linear, angular = (figures.linear_residual, figures.angular_residual) if figures else (None, None)
        took = "" if solve.seconds is None else f" · {solve.seconds:.0f} s"
        rows.append(
            f"<div style='margin:.25em 0'><b>{html.escape(solve_words(solve))}</b>{took}"
            f"<div style='opacity:.8'>{_STATES[solve.state]}{_decided(solve)} · "
            f"{_shown(linear and linear.rms_N)} N · {_shown(angular and angular.rms_Nm)} N·m</div></div>"
        )
    return boxed("".join(rows))


def _decided(solve: Solve) -> str:
    """By whom, where it was not the one who asked for the solve."""
    if solve.state == NEW or solve.decided_by in (None, solve.by):
        return ""
    return html.escape(f" (decided by {solve.decided_by})")


def settings_html(settings: Mapping[str, Any], standard: Mapping[str, Any]) -> str:
    """Which settings the fit on the screen was made with, as far as they are not the usual ones."""
    usual = by_name(standard)
    changed = [
        f"{name} = {value}"
        for name, value in by_name(settings).items()
        if name in usual and value != usual[name]
    ]
    if not changed:
        return boxed("Usual settings. A settings.toml in the subject's folder changes them.")
    return boxed("<b>Settings of its own</b><br>" + "<br>".join(html.escape(line) for line in changed))


def unbroken(text: str) -> str:
    """A number and its unit stay together."""
    return text.replace(" ", "\u00a0")


def _two_digits(value: float, sign: str = "") -> str:
    """All digits of large numbers, two of small ones."""
    text = f"{value:{sign}.0f}" if abs(value) >= TEN else f"{value:{sign}.2g}"
    return text.replace("-", "−")


def _shown(value: float | None) -> str:
    return "–" if value is None else f"{value:.1f}"
