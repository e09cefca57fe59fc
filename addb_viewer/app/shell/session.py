"""One reviewer at one browser: a trial, a cursor, a camera, and the desks that work on them."""

import threading
import time
from collections.abc import Sequence

import viser

from addb_viewer.app.diagnosis.controller import DiagnosisDesk
from addb_viewer.app.page.browser_memory import Remembered
from addb_viewer.app.page.handles import put
from addb_viewer.app.page.notices import Notices
from addb_viewer.app.page.questions import Questions
from addb_viewer.app.page.reviewer_name import Naming
from addb_viewer.app.queue.controller import QueueDesk
from addb_viewer.app.record.controller import RecordDesk
from addb_viewer.app.review.controller import ReviewDesk
from addb_viewer.app.review.panel import build_review
from addb_viewer.app.scene.camera import VIEWS, look
from addb_viewer.app.scene.scene import Scene, heading
from addb_viewer.app.shell import keys
from addb_viewer.app.shell.actions import actions_of, bind
from addb_viewer.app.shell.banner import banner_html
from addb_viewer.app.shell.controls import build_controls, speed_name
from addb_viewer.app.shell.finishing import Finishing
from addb_viewer.app.shell.fit_html import change_html, legend_html, notes_html, summary_html
from addb_viewer.app.shell.layout import Layout, fitted
from addb_viewer.app.shell.page_script import send_scripts
from addb_viewer.app.shell.playback import Pace, Playback, Position
from addb_viewer.app.shell.updates import Hearing
from addb_viewer.app.solve.controller import SolveDesk
from addb_viewer.app.solve.panel import build_solve
from addb_viewer.app.subjects.shared_subject import SubjectRoom
from addb_viewer.app.subjects.workspace import House
from addb_viewer.app.timeline.controller import TimelineDesk
from addb_viewer.app.trial.replay import Replay

READOUT_EVERY = 0.1  # [s] while playing: slider and time
SCRUBBING = 0.3  # [s] for so long the slider under a person's hand is not moved from here


class Session:
    """What one browser shows. Everything that a person asks is done by one hand, in order."""

    def __init__(
        self, client: viser.ClientHandle, house: House, room: SubjectRoom, pace: Pace, memory: Remembered
    ) -> None:
        """Lay out the page.

        Args:
            client: the browser.
            house: all subjects.
            room: the one to begin with.
            pace: of all browsers together.
            memory: what the browser remembers.
        """
        self.client, self.house, self._room = client, house, room
        self.notices = Notices(client, pace.first)
        self.memory = memory
        self.questions, self.finishing = Questions(client.gui, self.notices), Finishing(self)
        self._drawing = threading.RLock()  # the scene belongs to one thread at a time
        self.hearing = Hearing(self, pace)
        self._replay: Replay | None = None
        self._looked = self._closed = False
        self._read_at = self.scrubbed_at = 0.0
        client.gui.configure_theme(show_logo=False, show_share_button=False, dark_mode=self.memory.dark)
        send_scripts(client)
        self.scene = Scene(client)
        self.layout: Layout = fitted(client)
        self.playback = Playback(self.notices.guard("Drawing", self._draw), pace=pace)
        gui = client.gui
        self.controls = build_controls(gui, tuple(VIEWS), dark=self.memory.dark)
        gui.main_panel.dock_left()
        gui.main_panel.set_width(self.layout.controls_width)
        panel = gui.add_panel()
        self.timeline = TimelineDesk(gui, panel.add_tab("Timeline", viser.Icon.CHART_LINE), self, self.layout)
        self.diagnosis = DiagnosisDesk(
            gui, panel.add_tab("Diagnosis", viser.Icon.STETHOSCOPE), self, self.notices
        )
        self.recording = RecordDesk(
            gui, panel.add_tab("Record", viser.Icon.DEVICE_FLOPPY), self, self.notices
        )
        with panel.add_tab("Keys", viser.Icon.KEYBOARD):
            gui.add_html(keys.page_html())
        panel.dock_right()
        panel.set_width(self.layout.timeline_width)
        tabs, feet = self.controls.tabs, room.subject.foot_bodies
        self.review = ReviewDesk(self, build_review(gui, tabs.review, feet), self.notices)
        author = self.review.panel.author
        self.naming = Naming(memory, self.questions, house.people, self.page, author)
        self.notices.unnamed = self.naming.ask
        self.queue = QueueDesk(gui, tabs.queue, house, self, self.notices)
        self.solving = SolveDesk(self, build_solve(gui, tabs.solve), self.notices)
        bind(self)
        keys.register(gui, actions_of(self), self.notices, self.questions)
        house.people.listen(self.page, self.hearing)
        self.playback.start()

    @property
    def room(self) -> SubjectRoom:
        """The subject on the screen."""
        return self._room

    @property
    def replay(self) -> Replay | None:
        """The trial on the screen; None before the first one opened."""
        return self._replay

    @property
    def frame(self) -> int:
        """The cursor."""
        return self.playback.position.frame

    @property
    def shown(self) -> str | None:
        """The name of the trial on the screen."""
        return None if self._replay is None else self._replay.name

    @property
    def page(self) -> int:
        """The number that the server gave the browser's page."""
        return self.client.client_id

    @property
    def name(self) -> str:
        """Who is here; empty where nobody has said."""
        return self.naming.name

    def author(self) -> str:
        """Who decides here.

        Raises:
            NameNeededError: nobody has said; the page asks, and does then what was asked for.
        """
        return self.naming.author()

    def trials(self) -> Sequence[str]:
        """Names of the subject's trials."""
        return self._room.library.trials

    def enter(self, trial: str | None = None) -> None:
        """Be told what happens to the subject, and show this trial, else the first that can be read."""
        self._room.enter(self.hearing)
        self.client.gui.set_panel_label(self._room.subject.name)
        self.controls.trial.options = tuple(self.trials())
        wanted = [name for name in self.trials() if name == trial]
        for name in dict.fromkeys([*wanted, *self.trials()]):
            try:
                self.open_trial(name)
                break
            except Exception as error:  # another trial may be whole
                self.notices.error(f"Opening {name}", error)
        self.diagnosis.show()
        self.recording.show()
        self.explain()
        self.queue.show()

    def open(self, subject: str, trial: str | None) -> None:
        """Show a trial of any subject; None: its first one.

        Raises:
            CaptureError, ResultsError: the subject cannot be read; the present one stays.
        """
        if subject != self._room.name:
            room = self.house.room(subject)
            self._room.leave(self.hearing)
            self._room = room
            self._replay, self.solving.comparing = None, False
            self.enter(trial)
            self.house.tidy()
        elif trial is not None and trial != self.shown:
            self.open_trial(trial)

    def open_trial(self, name: str, frame: int = 0) -> None:
        """Show a trial of the present subject.

        Raises:
            CaptureError: its files cannot be read; the present trial stays.
        """
        library = self._room.library
        try:
            replay = library.replay(name)
        except Exception:
            if self.shown is not None:
                put(self.controls.trial, self.shown)
            raise
        with self._drawing:
            self._replay = replay
            self.playback.open(replay.frames, replay.rate, frame)
            self.scene.show(replay, library.meshes)
            self._fill_panel(replay)
            self.solving.show()
            self._compare()
            self.timeline.show()
            self.review.open(self._room.subject.foot_bodies)
            self.diagnosis.show_trial(replay)
            self.memory.place = (self._room.name, name)
            self.house.people.go(self.page, self.memory.place)
            self.queue.draw()
            self.show_banner()
            self._room.opened(name)
            self.review.warm_up()
            if not self._looked:  # later trials are seen from where the reviewer went
                self.view("Reset")

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
        self.scene.explain(self.diagnosis.state.figures)
        if self._replay is not None:
            diagnosed = self.scene.figures is not None
            self.controls.show.legend.content = legend_html(self._replay, diagnosed=diagnosed)
        self.draw_lanes()
        self.playback.redraw()

    def draw_lanes(self) -> None:
        """Show what has changed in the lanes."""
        self.timeline.draw_lanes()

    def show_banner(self) -> None:
        """Put above the tabs what everybody at this trial should see."""
        others = self.house.people.others(self.page).get(self.queue.here, ())
        banner, content = self.controls.banner, banner_html(self._room, others)
        if banner.content != content:
            banner.content = content
        if banner.visible != bool(content):
            banner.visible = bool(content)

    def set_dark(self, dark: bool) -> None:
        """Turn the theme."""
        self.memory.dark = dark
        put(self.controls.show.dark, dark)
        self.client.gui.configure_theme(show_logo=False, show_share_button=False, dark_mode=dark)

    def compare_changed(self) -> None:
        """The comparison was switched on or off, or is with another solve."""
        self.solving.show()
        self._compare()
        self.timeline.show()

    def close(self) -> None:
        """The browser has gone: end its threads and forget it."""
        if self._closed:
            return
        self._closed = True
        self._room.leave(self.hearing)
        self.house.people.leave(self.page)
        self.notices.close()
        self.playback.stop()
        self.house.tidy()

    def requeue(self, revision: int | None = None) -> None:
        """Show the queue with the rows of this subject read anew; arguments as for `House.refresh`."""
        self.house.refresh(self._room.name, revision)
        self.queue.draw()

    def show_fit(self) -> None:
        """Show the trial again, at the present frame, as the fit that is now on the screen has it."""
        if self.shown is not None:
            self.open_trial(self.shown, self.frame)
        self.diagnosis.show()
        self.explain()
        self.requeue()

    def show_summary(self) -> None:
        """Show the figures of the trial on the screen, as they are now."""
        replay, library, subject = self._replay, self._room.library, self._room.subject
        if replay is None:
            return
        fit = library.fit
        mass, height = (fit.mass_kg, fit.height_m) if fit else (subject.mass_kg, subject.height_m)
        person = {k: v for k, v in (("mass_kg", mass), ("height_m", height)) if v is not None}
        figures = library.figures(replay.name)
        self.controls.summary.content = summary_html(figures, person, replay)
        self.controls.change.content = change_html(figures.get("change"))

    def _compare(self) -> None:
        other, library = self.solving.other, self._room.other
        self.scene.compare(other.bodies if other else None, library.meshes if library else {})
        self.playback.redraw()

    def _fill_panel(self, replay: Replay) -> None:
        c, library = self.controls, self._room.library
        c.frame.max = max(replay.frames - 1, 1)
        put(c.trial, replay.name)
        self.show_summary()
        c.notes.content = notes_html((*library.notes, *replay.notes))
        c.show.legend.content = legend_html(replay, diagnosed=self.scene.figures is not None)

    def _draw(self, position: Position) -> None:
        replay = self._replay
        if replay is None or self._closed:
            return
        frame = min(position.frame, replay.frames - 1)
        with self._drawing, self.client.atomic():
            self.scene.draw(frame)
            self.timeline.cursor(frame)
            self._show_position(position, frame, replay)

    def _show_position(self, position: Position, frame: int, replay: Replay) -> None:
        c, now = self.controls, time.perf_counter()
        c.play.label = "Pause" if position.playing else "Play"
        put(c.speed, speed_name(position.speed))
        if position.playing and now - self._read_at < READOUT_EVERY:
            return
        self._read_at = now
        if now - self.scrubbed_at > SCRUBBING or not 0 <= c.frame.value < replay.frames:
            put(c.frame, frame)
        self.diagnosis.cursor(frame)
        if not position.playing:
            self.review.moved()
            self.review.show_selection()
            self.timeline.select(self.review.chosen)
