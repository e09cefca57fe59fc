"""One reviewer at one browser: a trial, a cursor, a camera, and the tabs that work on them."""

import threading
import time
from collections.abc import Callable, Sequence

import viser

from addb_viewer.app.curves.curves_controller import CurvesController
from addb_viewer.app.diagnosis.diagnosis_controller import DiagnosisController
from addb_viewer.app.jobs.job_queue import Outcome, Task, TaskProgress
from addb_viewer.app.page.channel import Channel
from addb_viewer.app.page.handles import put
from addb_viewer.app.page.notices import Notices
from addb_viewer.app.page.questions import Questions
from addb_viewer.app.page.reviewer import BrowserMemory, Reviewer
from addb_viewer.app.queue.queue_controller import Finishing, QueueController
from addb_viewer.app.queue.trial_queue import TrialQueue
from addb_viewer.app.record.record_controller import RecordController
from addb_viewer.app.review.review_controller import ReviewController
from addb_viewer.app.review.review_panel import ReviewPanel
from addb_viewer.app.scene.camera import VIEWS, eye_of, fit, look, when_at_rest
from addb_viewer.app.scene.scene import TrialScene, heading
from addb_viewer.app.security.access import TrialAddress
from addb_viewer.app.shell.bar import Bar, TimelineController
from addb_viewer.app.shell.controls import Controls, layout_for
from addb_viewer.app.shell.playback import Pace, Playback, Position
from addb_viewer.app.solve.solve_controller import SolveController, SolvePanel
from addb_viewer.app.subjects.shared_subject import SharedSubject
from addb_viewer.app.video.video_controller import VideoController
from addb_viewer.trial_view.forces_in_use import is_changed
from addb_viewer.trial_view.proposals import still_open
from addb_viewer.trial_view.replay import Replay
from addb_viewer.trial_view.trial_verdict import TrialVerdict, trial_verdict
from annotations.events import Edit


class Updates:
    """Listens to the subject on the screen, and to the queue, for one session."""

    def __init__(self, session: "Session", pace: Pace) -> None:
        """Hear nothing before somebody tells it.

        Args:
            session: of the browser.
            pace: of all browsers together.
        """
        self.session, self.pace = session, pace
        self._lock = threading.Lock()
        self._edits: list[Edit] = []  # that are not shown yet
        self._rows_came = False  # that cannot be read
        self._queue_waits = False

    def edited(self, edits: Sequence[Edit]) -> None:
        """Somebody recorded edits; none of them: a row came that cannot be read."""
        with self._lock:
            waits = bool(self._edits) or self._rows_came
            self._edits += edits
            self._rows_came |= not edits
        notices = self.session.notices
        if notices.at_hand:
            notices.guard("Showing the review", self._show_edits)()
        elif not waits:  # else whoever shows those that wait shows these as well
            notices.do("Showing the review", self._show_edits_in_turn)

    def fit_changed(self) -> None:
        """Another fit is on the screen, or is compared with."""
        self.session.notices.do("Showing the fit", self.session.show_fit)

    def progressed(self, progress: TaskProgress) -> None:
        """Something is at work."""
        self.session.show_progress()

    def ended(self, task: Task, outcome: Outcome) -> None:
        """Nothing is at work any more."""
        self.session.notices.do("Showing what came of it", lambda: self.session.show_outcome(task, outcome))

    def failed(self, doing: str, error: Exception) -> None:
        """Something that all depend on failed."""
        self.session.notices.error(doing, error)

    def told(self, title: str, body: str) -> None:
        """Something happened that all should know."""
        self.session.notices.tell(title, body, important=True)

    def queue_changed(self) -> None:
        """Rows of the queue, or who is where, are others now."""
        with self._lock:
            waits, self._queue_waits = self._queue_waits, True
        if not waits:
            self.session.notices.do("Showing the queue", self._show_queue)

    def _show_queue(self) -> None:
        with self._lock:
            self._queue_waits = False
        with self.pace.turn():
            self.session.show_queue()

    def _show_edits_in_turn(self) -> None:
        with self.pace.turn():
            self._show_edits()

    def _show_edits(self) -> None:
        with self._lock:
            edits, self._edits = self._edits, []
            rows_came, self._rows_came = self._rows_came, False
        if edits or rows_came:  # else shown with earlier ones
            self.session.show_edits(edits, unreadable=rows_came)


READOUT_EVERY = 0.1  # [s] while playing: what is measured


class Session:
    """What one browser shows. Everything that a person asks is done by one hand, in order."""

    def __init__(
        self,
        client: viser.ClientHandle,
        trials: TrialQueue,
        shared: SharedSubject,
        pace: Pace,
        memory: BrowserMemory,
        *,
        channel: Channel,
    ) -> None:
        """Lay out the page.

        Args:
            client: the browser.
            trials: the queue of all trials.
            shared: the subject to begin with.
            pace: of all browsers together.
            memory: what the browser remembers.
            channel: to our own parts of the page.
        """
        self.client, self.trials, self._shared = client, trials, shared
        self.people = trials.people
        self.memory, self.channel, self.bar = memory, channel, Bar(self)
        self.notices = Notices(client, channel, pace.first)
        self.at_end: Callable[[], None] = lambda: None
        self.questions = Questions(channel, self.notices)
        self.drawing = threading.RLock()  # the scene belongs to one thread at a time
        self.updates = Updates(self, pace)
        self._replay: Replay | None = None
        self._looked, self._closed, self._read_at = False, False, 0.0
        self.picture: tuple[float, float] | None = (
            None  # size of the scene in the page [px], where it says so
        )
        self._turn_theme()
        self.scene = TrialScene(client)
        self.layout = layout_for(client)
        self.playback = Playback(self.notices.guard("Drawing", self._draw), pace=pace)
        when_at_rest(client, self.playback.redraw)
        gui = client.gui
        self.controls = Controls(gui, tuple(VIEWS), dark=self.memory.dark)
        gui.main_panel.dock_left()
        gui.main_panel.set_width(self.layout.controls_width)
        panel = gui.add_panel()
        self.timeline = TimelineController(self, lambda: self.solving.other)
        curves_tab = panel.add_tab("Curves", viser.Icon.CHART_LINE)
        self.curves = CurvesController(gui, curves_tab, self, memory, lambda: self.solving.other)
        self.diagnosis = DiagnosisController(
            gui, panel.add_tab("Diagnosis", viser.Icon.STETHOSCOPE), self, self.notices
        )
        self.recording = RecordController(
            gui, panel.add_tab("Record", viser.Icon.DEVICE_FLOPPY), self, self.notices
        )
        with panel.add_tab("Keys", viser.Icon.KEYBOARD):
            self.keys_page = gui.add_html("")
        panel.dock_right()
        panel.set_width(self.layout.timeline_width)
        tabs = self.controls
        self.review = ReviewController(self, ReviewPanel(gui, tabs.review), self.notices)
        author = self.review.panel.author
        self.reviewer = Reviewer(memory, self.questions, self.people, self.page, author)
        self.notices.unnamed = self.reviewer.ask
        self.queue = QueueController(trials, self)
        self.finishing = Finishing(self, self.review, self.queue)
        self.video = VideoController(gui, tabs.view, self, self.notices)
        self.solving: SolveController = SolveController(self, SolvePanel(gui, tabs.solve), self.notices)
        self.people.listen(self.page, self.updates)
        self.playback.start()

    @property
    def shared(self) -> SharedSubject:
        """The subject on the screen."""
        return self._shared

    @property
    def replay(self) -> Replay | None:
        """The trial on the screen; None before the first one opened."""
        return self._replay

    @property
    def frame(self) -> int:
        """The cursor."""
        return self.playback.position.frame

    @property
    def playing(self) -> bool:
        """Whether the cursor runs."""
        return self.playback.position.playing

    @property
    def shown(self) -> str | None:
        """The name of the trial on the screen."""
        return None if self._replay is None else self._replay.name

    @property
    def verdict(self) -> TrialVerdict:
        """Where the trial on the screen stands, in the fit on the screen."""
        replay, fits, state = self._replay, self._shared.fits, self.diagnosis.state
        if replay is None:  # none can be read
            return trial_verdict(None, None)
        review = self.review.review
        return trial_verdict(
            fits.shown.figures(replay.name),
            review,
            None if state.changed else state.figures,
            state.decided,
            proposals=still_open(self.review.proposals),
            waiting=() if fits.new is None else (fits.new.by,),
            changed=is_changed(replay.feet, replay.forces, review),
        )

    @property
    def page(self) -> int:
        """The number that the server gave the browser's page."""
        return self.client.client_id

    def enter(self, trial: str | None = None, frame: int = 0) -> None:
        """Be told what happens to the subject, and show this trial, else the first that can be read."""
        self._shared.add_listener(self.updates)
        self.client.gui.set_panel_label(self._shared.subject.name)
        names = self._shared.fits.shown.trials
        wanted = [name for name in names if name == trial]
        for name in dict.fromkeys([*wanted, *names]):
            try:
                self.open_trial(name, frame if name == trial else 0)
                break
            except Exception as error:  # another trial may be whole
                self.notices.error(f"Opening {name}", error)
        self.diagnosis.show()
        self.recording.show()
        self.explain()
        self.bar.show()

    def open(self, subject: str, trial: str | None) -> None:
        """Show a trial of any subject; None: its first one.

        Raises:
            CaptureError, ResultsError: the subject cannot be read; the present one stays.
        """
        if subject != self._shared.name:
            shared = self.trials.subjects.subject(subject)
            self._shared.remove_listener(self.updates)
            self._shared = shared
            self._replay, self.solving.comparing = None, False
            self.enter(trial)
            self.trials.subjects.close_unwatched()
        elif trial is not None and trial != self.shown:
            self.open_trial(trial)

    def open_trial(self, name: str, frame: int = 0) -> None:
        """Show a trial of the present subject.

        Raises:
            CaptureError: its files cannot be read; the present trial stays.
        """
        library = self._shared.fits.shown
        replay = library.replay(name)
        if self.memory.place != (self._shared.name, name):
            self.questions.no()  # it was about another trial
        with self.drawing:
            self._replay = replay
            self.playback.open(replay.frames, replay.rate, frame or replay.first_in_view)
            self.scene.show(replay, library.meshes, self.frame)
            self.show_summary()
            self.controls.show.legend.content = self.scene.legend
            self.compare_changed()
            self.review.open()
            self.diagnosis.show_trial(replay)
            self.video.open()
            place = self.memory.place = (self._shared.name, name)
            self.memory.keep()
            self.people.go(self.page, place)
            self.show_queue()
            if not self._looked:  # later trials are seen from where the reviewer went
                self.view("Reset")
            fit(self.client, self.scene.extent(self.frame))

    def go_to(self, trial: str, frame: int) -> None:
        """Show a frame of a trial of this subject."""
        if trial != self.shown:
            self.open_trial(trial)
        self.playback.seek(frame)

    def seek(self, frame: int) -> None:
        """Move the cursor."""
        self.playback.seek(frame)

    def view(self, name: str) -> None:
        """Look from one of the named sides."""
        if self._replay is not None:
            self._looked = True
            look(self.client, name, heading(self._replay), self.scene.center(self.frame))

    def explain(self) -> None:
        """Draw the causes of the diagnosis that is kept."""
        self.scene.explain(self.diagnosis.uncorrected)
        self.controls.show.legend.content = self.scene.legend
        self.draw_lanes()
        self.playback.redraw()

    def draw_lanes(self) -> None:
        """Show what has changed in the lanes."""
        if self._replay is not None:
            lanes = self.review.lanes(self.diagnosis.uncorrected)
            self.timeline.draw_lanes(lanes, self.review.chosen)
            self.bar.show_chips()

    def set_dark(self, dark: bool) -> None:
        """Turn the theme."""
        self.memory.choose_theme(dark)
        self._show_theme()

    def system_turned(self, dark: bool) -> None:
        """The reviewer's system wishes dark pages, or no longer."""
        self.memory.system_dark = dark
        self._show_theme()

    def _show_theme(self) -> None:
        put(self.controls.show.dark, self.memory.dark)
        self._turn_theme()

    def _turn_theme(self) -> None:
        dark = self.memory.dark
        self.client.gui.configure_theme(show_logo=False, show_share_button=False, dark_mode=dark)
        self.channel.show("theme", "dark" if dark else "light")

    def compare_changed(self) -> None:
        """The comparison was switched on or off, or is with another solve."""
        self.solving.show()
        other, library = self.solving.other, self._shared.fits.compared
        self.scene.compare(other.bodies if other else None, library.meshes if library else {})
        self.playback.redraw()
        self.timeline.show()
        self.curves.show()

    def show_edits(self, edits: Sequence[Edit], *, unreadable: bool) -> None:
        """Show edits of the subject, by whomever; or that rows came that cannot be read."""
        if unreadable or any(edit.trial == self.shown for edit in edits):
            self.review.others_edited(edits)
        self.diagnosis.show_reviews()
        revision = None if unreadable else max(edit.number for edit in edits)
        self.notices.do("Showing the queue", lambda: self.requeue(revision))

    def show_progress(self) -> None:
        """Show what is at work."""
        self.bar.show_work()

    def show_outcome(self, task: Task, outcome: Outcome) -> None:
        """Show what came of what was at work."""
        for tab in (self.solving, self.diagnosis, self.recording):
            tab.ended(task, outcome)
        self.explain()
        self.compare_changed()
        self.show_summary()
        self.bar.show()

    def show_queue(self) -> None:
        """Show who is where, and the trial's place in the queue, as they are now."""
        self.bar.show()

    def diagnose(self) -> None:
        """X."""
        self.diagnosis.diagnose_or_show()

    def close(self) -> None:
        """The browser has gone: end its threads and forget it."""
        if self._closed:
            return
        self._closed = True
        self._shared.remove_listener(self.updates)
        self.people.leave(self.page)
        self.notices.close()
        self.playback.stop()
        self.review.asking.rest_no_more()
        self.at_end()
        self.trials.subjects.close_unwatched()

    def requeue(self, revision: int | None = None) -> None:
        """Show the queue with the rows of this subject read anew; arguments as for `TrialQueue.refresh`."""
        self.trials.refresh(self._shared.name, revision)
        self.show_queue()

    def show_fit(self) -> None:
        """Show the trial again, at the present frame, as the fit that is now on the screen has it."""
        if self.shown is not None:
            self.open_trial(self.shown, self.frame)
        self.diagnosis.show()
        self.explain()
        self.requeue()

    def show_summary(self) -> None:
        """Show the figures of the trial on the screen, as they are now."""
        if self._replay is not None:
            self.controls.fit.show(self._shared.fits.shown, self._replay)

    def _draw(self, _: Position) -> None:
        with self.drawing, self.client.atomic():  # another trial may have come while this waited
            replay, position = self._replay, self.playback.position
            if replay is None or self._closed:
                return
            frame = min(position.frame, replay.frames - 1)
            self.scene.draw(frame, eye_of(self.client.camera, self.picture))
            self.timeline.cursor(frame)
            self._show_position(position, frame, replay)

    def _show_position(self, position: Position, frame: int, replay: Replay) -> None:
        c, now = self.controls, time.perf_counter()
        self.channel.show("plays", position.speed if position.playing and not position.held else 0)
        if position.playing and not position.held and now - self._read_at < READOUT_EVERY:
            return
        self._read_at = now
        c.show.measured.content = self.scene.measuring.told(frame)
        if not position.playing or position.held:
            self.channel.show("address", str(TrialAddress(self._shared.name, replay.name, frame)))
            self.review.moved()
            self.review.show_selection()
            self.timeline.select(self.review.chosen)
            self.bar.show_chips()
