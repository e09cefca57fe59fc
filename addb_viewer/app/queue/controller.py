"""The Queue panel of one browser: all trials of the root, worst first; a click opens one."""

import html
from collections.abc import Mapping, Sequence

import viser

from addb_viewer.app.page.notices import Notices
from addb_viewer.app.page.screen import Place
from addb_viewer.app.queue.fit_all_html import fitting_html
from addb_viewer.app.queue.next_trial import next_trial, to_review
from addb_viewer.app.queue.rows import Filter, Row, shown
from addb_viewer.app.style.html_pieces import boxed
from addb_viewer.app.subjects.people import TrialPlace
from addb_viewer.app.subjects.workspace import House
from annotations.events import Status
from solver.errors import SolverError

MOST = 200  # rows on the page; the filter finds the others
FIGURE = "text-align:right;white-space:nowrap;padding-left:.5em;"  # style of a column of figures
HEADINGS = ("of<br>bound", "left<br>out", "to<br>decide")  # residual, frames, proposals
SIGNS = {Status.UNSEEN: "○", Status.IN_WORK: "◐", Status.FINISHED: "●", Status.SECOND_LOOK: "!"}


class QueueDesk:
    """Which trial is next."""

    def __init__(
        self, gui: viser.GuiApi, tab: viser.GuiTabHandle, house: House, place: Place, notices: Notices
    ) -> None:
        self.house, self.place, self.notices = house, place, notices
        self._rows: list[Row] = []
        with tab:
            self.count = gui.add_html("")
            self.fit_all = gui.add_button(
                "Fit all that have no fit",
                hint="One subject at a time, after what people ask for; you can go on meanwhile",
                visible=False,
            )
            self.fitting = gui.add_html("", visible=False)
            self.cancel = gui.add_button(
                "Cancel the fits",
                color="gray",
                hint="The fit at work is dropped; those that have come stay",
                visible=False,
            )
            self.which = gui.add_dropdown("Show", tuple(Filter), initial_value=Filter.ALL)
            self.words = gui.add_text("Filter", "", hint="Part of a subject's or a trial's name")
            self.table = gui.add_html("")
            self.again = gui.add_button(
                "Read anew", color="gray", hint="New subjects, fits of other programs"
            )
        for handle in (self.which, self.words):
            handle.on_update(notices.in_order("Filtering", self.draw))
        self.fit_all.on_click(notices.in_order("Fitting all", self.fit_unfitted))
        self.cancel.on_click(notices.in_order("Cancelling", house.fit_all.cancel))
        self.again.on_click(notices.in_order("Reading the queue", lambda: self.show(anew=True)))

    def show(self, *, anew: bool = False) -> None:
        """Read the queue, from memory unless it is to be read anew, and draw it."""
        self.house.rows(anew=anew)
        self.draw()

    def draw(self) -> None:
        """Put what the filter lets through on the screen."""
        rows = self.house.rows()
        trials = [row for row in rows if not row.error]
        done = sum(row.finished for row in trials)
        self._rows = self._let_through()[:MOST]
        count = boxed(f"<b>Reviewed {done} of {len(trials)}</b>, worst first")
        table = rows_html(
            self._rows,
            self.here,
            several=self.house.several,
            notes=self.house.root.notes,
            people=self.house.people.others(self.place.page),
            at_work=self.house.at_work(),
        )
        self._draw_fitting()
        if self.count.content != count:
            self.count.content = count
        if self.table.content != table:
            self.table.content = table

    def fit_unfitted(self) -> None:
        """Fit all subjects without a fit.

        Raises:
            SolverError: there is none.
        """
        names = self.house.unfitted()
        if not names:
            raise SolverError("every subject has a fit already")
        self.house.fit_all.start(names, self.place.name)

    def _draw_fitting(self) -> None:
        state = self.house.fit_all.state
        content = fitting_html(state)
        unfitted = len(self.house.unfitted()) if self.house.several and not state.running else 0
        label = f"Fit all that have no fit ({unfitted})"
        if unfitted and self.fit_all.label != label:
            self.fit_all.label = label
        if self.fitting.content != content:
            self.fitting.content = content
        for handle, visible in (
            (self.fit_all, bool(unfitted)),
            (self.fitting, bool(content)),
            (self.cancel, state.running),
        ):
            if handle.visible != visible:
                handle.visible = visible

    def open_row(self, index: int) -> None:
        """Open a row that was clicked.

        Raises:
            SolverError: there is no such row, or its subject cannot be read.
        """
        if index >= len(self._rows):
            raise SolverError("the queue has changed; choose again")
        row = self._rows[index]
        if row.error:
            raise SolverError(row.error)
        self.place.open(row.subject, row.trial)

    @property
    def here(self) -> TrialPlace:
        """Subject and trial on the screen."""
        replay = self.place.replay
        return self.place.room.name, replay.name if replay else ""

    def offer(self) -> Row | None:
        """The trial to go on with by filter and order, offered to nobody else; None: there is none."""
        rows, here = self._let_through(), self.here
        return self.house.people.offer(self.place.page, lambda taken: next_trial(rows, here, taken))

    def outside(self) -> int:
        """How many trials wait for a person that the filter does not let through."""
        waiting = len(to_review(self.house.rows(), self.here))
        return waiting - len(to_review(self._let_through(), self.here))

    def _let_through(self) -> list[Row]:
        return shown(self.house.rows(), Filter(self.which.value), self.words.value)

    def taken(self) -> list[str]:
        """In words, who is on the trials that wait."""
        people = self.house.people.others(self.place.page)
        waiting = [(row.subject, row.trial) for row in to_review(self._let_through(), self.here)]
        return [f"{', '.join(people[place])} on {place[1]}" for place in waiting if place in people]


def rows_html(
    rows: Sequence[Row],
    here: TrialPlace,
    *,
    several: bool,
    notes: Sequence[str] = (),
    people: Mapping[TrialPlace, Sequence[str]] | None = None,
    at_work: Mapping[str, str] | None = None,
) -> str:
    """The queue as a table.

    Args:
        rows: in order.
        here: subject and trial on the screen.
        several: whether the root has several subjects.
        notes: on what was left out.
        people: names of the others, by where they are.
        at_work: what is at work, by subject; safe HTML.
    """
    body = "".join(
        _row_html(i, row, here, several, _told(rows[:i], row, people or {}, at_work or {}))
        for i, row in enumerate(rows)
    )
    head = "<tr style='opacity:.75'><td></td><td>trial</td>"
    head += "".join(f"<td style='{FIGURE}'>{words}</td>" for words in HEADINGS) + "</tr>"
    told = "".join(f"<div>⚠ {html.escape(note)}</div>" for note in notes)
    return boxed(
        f"<table style='width:100%;border-collapse:collapse'>{head}{body}</table>"
        "<div style='opacity:.75;margin-top:.3em'>residual in units of its bound · "
        "○ unseen ◐ in work ● finished ! second look · * chosen by detection, not by a person</div>"
        f"{told}"
    )


def _told(
    above: Sequence[Row],
    row: Row,
    people: Mapping[TrialPlace, Sequence[str]],
    at_work: Mapping[str, str],
) -> str:
    """Below a trial's name: who is there; and what is about the whole subject, at its first row only."""
    here = people.get((row.subject, row.trial), ())
    lines = [f"{html.escape(' and '.join(here))} {'is' if len(here) == 1 else 'are'} here"] if here else []
    if not any(other.subject == row.subject for other in above):
        if row.subject in at_work:
            lines.append(at_work[row.subject])
        if row.waiting:
            lines.append(
                f"New solve of {html.escape(' and of '.join(row.waiting))} waits: keep or discard it"
            )
    return "".join(f"<div>{line}</div>" for line in lines)


def _row_html(index: int, row: Row, here: TrialPlace, several: bool, told: str) -> str:
    marked = "background:rgba(128,128,128,.25);" if (row.subject, row.trial) == here else ""
    name = f"<b>{html.escape(row.trial)}</b>" if row.trial else ""
    if several:
        name += f"<div style='opacity:.75'>{html.escape(row.subject)}</div>"
    if row.error:
        return (
            f"<tbody data-addb-wish='#{index}' style='cursor:pointer'><tr><td>⚠</td><td colspan='4'>"
            f"{html.escape(row.subject)}: {html.escape(row.error)}</td></tr></tbody>"
        )
    # what is told has the whole width: a reason may be long
    below = f"<tr><td></td><td colspan='4' style='overflow-wrap:anywhere'>{told}</td></tr>" if told else ""
    by = f" title='{html.escape(row.by)}'" if row.by else ""
    residual = "no fit" if row.figures is None else "–" if row.residual is None else f"{row.residual:.2f}"
    bad = "font-weight:700;" if row.residual is not None and row.residual > 1 else ""
    left_out = "" if row.left_out is None else f"{100 * row.left_out:.0f} %{'*' if row.undecided else ''}"
    return (
        f"<tbody data-addb-wish='#{index}' style='cursor:pointer;{marked}"
        "border-top:1px solid rgba(128,128,128,.3)'><tr>"
        f"<td{by} style='padding-right:.4em'>{SIGNS[row.status]}</td>"
        f"<td style='overflow-wrap:anywhere'>{name}</td>"
        f"<td style='{FIGURE}{bad}'>{residual}</td><td style='{FIGURE}'>{left_out}</td>"
        f"<td style='{FIGURE}'>{row.proposed or ''}</td></tr>{below}</tbody>"
    )
