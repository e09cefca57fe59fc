"""The Queue panel of one browser: all trials of the root, worst first; a click opens one."""

import time

import viser

from addb_viewer.app.page.notices import Notices
from addb_viewer.app.page.screen import Screen
from addb_viewer.app.queue.html import fitting_html, rows_html
from addb_viewer.app.queue.rows import Filter, Row, next_trial, shown, to_review
from addb_viewer.app.queue.trial_queue import TrialQueue
from addb_viewer.app.subjects.people import TrialPlace
from addb_viewer.trial_view.html_pieces import boxed
from solver.common.errors import SolverError

MOST_TAKEN = 5  # in words; the others are counted
MOST = 200  # rows on the page; the filter finds the others
PAGE_LINK = (
    "<a href='/queue' target='addb-viewer-queue'><b>The queue as a page</b></a>: filters, many at once"
)


class QueueController:
    """Which trial is next."""

    def __init__(
        self, gui: viser.GuiApi, tab: viser.GuiTabHandle, trials: TrialQueue, screen: Screen, notices: Notices
    ) -> None:
        self.trials, self.screen, self.notices = trials, screen, notices
        self._rows: list[Row] = []
        with tab:
            gui.add_html(boxed(PAGE_LINK))
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
        self.cancel.on_click(notices.in_order("Cancelling", trials.cancel_fits))
        self.again.on_click(notices.in_order("Reading the queue", lambda: self.show(anew=True)))

    def show(self, *, anew: bool = False) -> None:
        """Read the queue, from memory unless it is to be read anew, and draw it."""
        self.trials.rows(anew=anew)
        self.draw()

    def draw(self) -> None:
        """Put what the filter lets through on the screen."""
        rows = self.trials.rows()
        trials = [row for row in rows if not row.error]
        done = sum(row.finished for row in trials)
        self._rows = self.let_through()[:MOST]
        paged = self.screen.reviewer.browser in self.trials.orders
        how = "as the queue's page shows them" if paged else "worst first"
        count = boxed(f"<b>Reviewed {done} of {len(trials)}</b>, {how}")
        table = rows_html(
            self._rows,
            self.here,
            several=self.trials.subjects.several,
            notes=self.trials.subjects.root.notes,
            people=self.trials.people.others(self.screen.page),
            at_work=self.trials.at_work(),
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
        names = self.trials.unfitted()
        if not names:
            raise SolverError("every subject has a fit already")
        self.trials.fit_all.start(names, self.screen.reviewer.name)

    def _draw_fitting(self) -> None:
        state = self.trials.fit_all.state
        content = fitting_html(state)
        unfitted = len(self.trials.unfitted()) if self.trials.subjects.several and not state.running else 0
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
        self.screen.open(row.subject, row.trial)

    @property
    def here(self) -> TrialPlace:
        """Subject and trial on the screen."""
        replay = self.screen.replay
        return self.screen.shared.name, replay.name if replay else ""

    def offer(self) -> Row | None:
        """The trial to go on with by filter and order, offered to nobody else and nobody else's; or None."""
        rows, here = self._for_me(), self.here
        return self.trials.people.offer(self.screen.page, lambda taken: next_trial(rows, here, taken))

    def fit_ahead(self) -> None:
        """Have the next unfitted trials fitted in the background, while this one is reviewed."""
        waiting = to_review(self.let_through(), self.here)
        subjects = dict.fromkeys(row.subject for row in waiting if row.figures is None)
        self.trials.fit_ahead(list(subjects), self.screen.reviewer.name)

    def read_ahead(self) -> None:
        """Have the trial that would be next read in the background, while this one is reviewed."""
        row = next_trial(self._for_me(), self.here, self.trials.people.others(self.screen.page))
        if row is not None and row.figures is not None:
            self.trials.subjects.read_ahead(row.subject, row.trial)

    def outside(self) -> int:
        """How many trials wait for a person that the filter does not let through."""
        waiting = len(to_review(self.trials.rows(), self.here))
        return waiting - len(to_review(self.let_through(), self.here))

    def let_through(self) -> list[Row]:
        """The rows that the queue's page of this browser shows, as long as it is open; else this panel's."""
        rows, places = self.trials.rows(), self.trials.orders.get(self.screen.reviewer.browser)
        if places is None:
            return shown(rows, Filter(self.which.value), self.words.value)
        by_place = {(row.subject, row.trial): row for row in rows}
        return [by_place[place] for place in places if place in by_place]

    def taken(self) -> list[str]:
        """In words, who is on the trials that wait, or is to review them."""
        people = self.trials.people.others(self.screen.page)
        waiting = to_review(self.let_through(), self.here)
        told = []
        for row in waiting:
            if (row.subject, row.trial) in people:
                told.append(f"{', '.join(people[row.subject, row.trial])} on {row.trial}")
            elif self._left_to(row):
                told.append(f"{row.trial} is for {self._left_to(row)}")
        more = len(told) - MOST_TAKEN
        return [*told[:MOST_TAKEN], f"{more} more"] if more > 0 else told

    def _for_me(self) -> list[Row]:
        return [row for row in self.let_through() if not self._left_to(row)]

    def _left_to(self, row: Row) -> str:
        return row.left_to(self.screen.reviewer.name, self.trials.people.names, time.time())
