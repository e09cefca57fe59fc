"""The review app: puts scene, plots, panel and keys together."""

import os
import sys
import threading
import time
import webbrowser
from functools import partial
from pathlib import Path
from typing import Any

import viser

from addb_viewer.app import keys
from addb_viewer.app.camera import VIEWS, look
from addb_viewer.app.charts import charts_of
from addb_viewer.app.diagnosis_desk import DiagnosisDesk, Surroundings
from addb_viewer.app.effect_pictures import Figures
from addb_viewer.app.library import Library, open_library
from addb_viewer.app.notices import Notices
from addb_viewer.app.page_script import hand_back_the_keyboard
from addb_viewer.app.panels import (
    MOVES,
    SPEED_NAMES,
    build_controls,
    legend_html,
    notes_html,
    speed_name,
    summary_html,
)
from addb_viewer.app.playback import Playback, Position
from addb_viewer.app.plots import PlotPanel
from addb_viewer.app.replay import Replay
from addb_viewer.app.scene import Scene, heading
from addb_viewer.app.server import address, open_server

READOUT_EVERY = 0.1  # [s] while playing: slider and time
CURSOR_EVERY = 0.25  # [s] while playing: redrawing the plots costs a browser more than the scene
SCRUBBING = 0.3  # [s] for so long the slider under a person's hand is not moved from here
CONTROL_WIDTH, PLOT_WIDTH = 330, 390  # [pixel]


class ReviewApp:
    """One subject on one server."""

    def __init__(self, server: viser.ViserServer, library: Library) -> None:
        self.server, self.library = server, library
        self.notices = Notices(server)
        self.drawing = threading.RLock()  # scene and plots belong to one thread at a time
        server.gui.configure_theme(show_logo=False, show_share_button=False)
        hand_back_the_keyboard(server)
        self.scene = Scene(server)
        self.controls = build_controls(server.gui, library.trials, tuple(VIEWS))
        server.gui.set_panel_label(library.subject.name)
        server.gui.main_panel.dock_left()
        server.gui.main_panel.set_width(CONTROL_WIDTH)
        panel = server.gui.add_panel()
        self.plots = PlotPanel(server.gui, panel.add_tab("Plots", viser.Icon.CHART_LINE))
        self.desk = DiagnosisDesk(
            server.gui,
            panel.add_tab("Diagnosis", viser.Icon.STETHOSCOPE),
            Surroundings(lambda: self.library, self._explain, self._go_to, self._reload),
            self.notices,
        )
        panel.dock_right()
        panel.set_width(PLOT_WIDTH)
        self.playback = Playback(self.notices.guard("Drawing", self._draw))
        self.shown: str | None = None
        self.replay: Replay | None = None
        self.looked: str | None = None
        self.read_at = self.cursor_at = self.scrubbed_at = 0.0
        self._bind()
        others = {"diagnose": self.desk.diagnose, "accept": self.desk.accept, "reject": self.desk.reject}
        keys.register(server.gui, self._moves(), self._views() | others, self.notices)
        self.desk.show()
        self.playback.start()

    def open_trial(self, name: str) -> None:
        """Show a trial from its first frame.

        Raises:
            CaptureError: its files cannot be read; the present trial stays.
        """
        replay = self.library.replay(name)
        with self.drawing:
            self.playback.open(replay.frames, replay.rate)
            self.shown, self.replay = name, replay
            self.scene.show(replay, self.library.meshes)
            self.plots.show(replay, charts_of(replay))
            self.desk.show_trial(replay)
            self._fill_panel(replay, name)
            if self.looked is None:  # later trials are seen from where the reviewer went
                self.view("Reset")

    def view(self, name: str) -> None:
        """Look from one of the named sides."""
        if self.replay is not None:
            with self.drawing:
                self.looked = name
                look(self.server, name, heading(self.replay), self.scene.center(self.playback.position.frame))

    def close(self) -> None:
        """Stop working, drawing and serving."""
        self.desk.close()
        self.playback.stop()
        self.server.stop()

    def _fill_panel(self, replay: Replay, name: str) -> None:
        c, fit, subject = self.controls, self.library.fit, self.library.subject
        c.frame.max = max(replay.frames - 1, 1)
        _set(c.frame, 0)
        _set(c.trial, name)
        mass, height = (fit.mass_kg, fit.height_m) if fit else (subject.mass_kg, subject.height_m)
        person = {k: v for k, v in (("mass_kg", mass), ("height_m", height)) if v is not None}
        c.summary.content = summary_html(self.library.figures(name), person, replay)
        c.notes.content = notes_html((*self.library.notes, *replay.notes))
        c.legend.content = legend_html(replay, diagnosed=self.scene.figures is not None)

    def _explain(self, figures: Figures | None) -> None:
        with self.drawing:
            self.scene.explain(figures)
            if self.replay is not None:
                self.controls.legend.content = legend_html(self.replay, diagnosed=figures is not None)
        self.playback.redraw()

    def _go_to(self, trial: str, frame: int) -> None:
        if trial != self.shown:
            self.open_trial(trial)
        self.playback.seek(frame)

    def _reload(self) -> None:
        """Show the fit that is kept now, at the present frame."""
        library = open_library(self.library.subject.folder, self.library.results_folder)
        with self.drawing:
            self.library, frame = library, self.playback.position.frame
            if self.shown is not None:
                self.open_trial(self.shown)
                self.playback.seek(frame)

    def _draw(self, position: Position) -> None:
        with self.drawing:
            if self.replay is None:
                return
            frame = min(position.frame, self.replay.frames - 1)
            with self.server.atomic():
                self.scene.draw(frame)
                self._show_position(position, frame)

    def _show_position(self, position: Position, frame: int) -> None:
        assert self.replay is not None
        c, seconds, now = self.controls, float(self.replay.times[frame]), time.perf_counter()
        c.play.label = "Pause" if position.playing else "Play"
        _set(c.speed, speed_name(position.speed))
        if not position.playing or now - self.read_at >= READOUT_EVERY:
            self.read_at = now
            if now - self.scrubbed_at > SCRUBBING or not 0 <= c.frame.value < self.replay.frames:
                _set(c.frame, frame)
            _set(c.time, f"{seconds:.3f} s")
        if not position.playing or now - self.cursor_at >= CURSOR_EVERY:
            self.cursor_at = now
            self.plots.cursor(seconds)
            self.desk.cursor(seconds)

    def _moves(self) -> dict[str, keys.Action]:
        p = self.playback
        return {
            "toggle": p.toggle,
            "back_frame": lambda: p.step(-1),
            "on_frame": lambda: p.step(1),
            "back_tenth": lambda: p.step_seconds(-0.1),
            "on_tenth": lambda: p.step_seconds(0.1),
            "back_second": lambda: p.step_seconds(-1.0),
            "on_second": lambda: p.step_seconds(1.0),
            "first": lambda: p.seek(0),
            "last": lambda: p.seek(p.frames - 1),
            "slower": p.slower,
            "stop": p.pause,
            "faster": p.faster,
        }

    def _views(self) -> dict[str, keys.Action]:
        return {f"view_{name.lower()}": partial(self.view, name) for name in VIEWS}

    def _bind(self) -> None:
        c, guard, p = self.controls, self.notices.guard, self.playback

        def by_a_person(handle: viser.GuiInputHandle, doing: str, action: keys.Action) -> None:
            """What the app sets itself is no wish of anybody."""
            guarded = guard(doing, action)
            handle.on_update(lambda event: guarded() if event.client is not None else None)

        by_a_person(c.trial, "Opening the trial", self._chosen)
        by_a_person(c.frame, "Moving", self._scrubbed)
        by_a_person(c.speed, "Setting the speed", lambda: p.play_at(SPEED_NAMES[c.speed.value]))
        for handle in (c.bones, c.see_through, c.model_markers, c.forces, c.residual, c.causes, c.trails):
            by_a_person(handle, "Showing", self._options_changed)
        by_a_person(c.follow, "Following", self._follow_changed)
        c.play.on_click(guard("Playing", lambda _: p.toggle()))
        moves = self._moves()
        c.move.on_click(guard("Moving", lambda event: moves[MOVES[event.target.value]]()))
        c.view.on_click(guard("Turning the camera", lambda event: self.view(event.target.value)))

    def _scrubbed(self) -> None:
        self.scrubbed_at = time.perf_counter()
        self.playback.seek(int(self.controls.frame.value))

    def _chosen(self) -> None:
        with self.drawing:
            wanted = self.controls.trial.value
            if wanted == self.shown:
                return
            try:
                self.open_trial(wanted)
            except Exception:
                if self.shown is not None:
                    _set(self.controls.trial, self.shown)
                raise

    def _options_changed(self) -> None:
        c, o = self.controls, self.scene.options
        o.bones, o.see_through, o.model_markers = c.bones.value, c.see_through.value, c.model_markers.value
        o.forces, o.residual, o.causes = c.forces.value, c.residual.value, c.causes.value
        o.trail_seconds = float(c.trails.value)
        self.playback.redraw()

    def _follow_changed(self) -> None:
        with self.drawing:
            self.scene.follow(self.controls.follow.value, self.playback.position.frame)
        self.playback.redraw()


def _set(handle: viser.GuiInputHandle[Any], value: object) -> None:
    """Show a value that the app found, not a person."""
    handle.value = value  # type: ignore[misc]


def start(
    subject_folder: Path, host: str = "127.0.0.1", port: int = 8080, results: Path | None = None
) -> ReviewApp:
    """Open a subject in the app and return at once.

    Args:
        subject_folder: the recording.
        host: address to listen on.
        port: wished for; the next free one is taken when it's not.
        results: folder of the fit; inside the subject's folder by default.

    Raises:
        CaptureError, ResultsError: the folder or its fit cannot be read.
        AddressError: the host is no address of this machine.
    """
    library = open_library(subject_folder, results)
    app = ReviewApp(open_server(host, port), library)
    for name in library.trials:
        try:
            app.open_trial(name)
            break
        except Exception as error:  # another trial may be whole
            app.notices.error(f"Opening {name}", error)
    return app


def serve(
    subject_folder: Path, host: str = "127.0.0.1", port: int = 8080, results: Path | None = None
) -> None:
    """Show a subject in the browser until Ctrl+C; prints the address. Arguments as for `start`."""
    app = start(subject_folder, host, port, results)
    where = address(app.server, host)
    taken = f"Port {port} is taken. " if port and app.server.get_port() != port else ""
    print(f"{taken}The app is at {where} (Ctrl+C ends it).", flush=True)
    if _has_display():
        webbrowser.open(where)
    try:
        _until_interrupted()
    except KeyboardInterrupt:
        print()
    finally:
        app.close()


def _until_interrupted() -> None:
    threading.Event().wait()


def _has_display() -> bool:
    """Whether a browser could open beside the terminal."""
    if sys.platform in ("darwin", "win32"):
        return "SSH_CONNECTION" not in os.environ
    return any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))
