"""Recordings from one browser: files of the fit on the screen, and the log of the session."""

from functools import partial
from pathlib import Path

import viser

from addb_viewer.app.jobs.job_queue import Progress, Task
from addb_viewer.app.jobs.worker_process import Outcome
from addb_viewer.app.page.handles import put
from addb_viewer.app.page.notices import Notices
from addb_viewer.app.page.screen import Place
from addb_viewer.app.record.html import log_html, written_html
from addb_viewer.app.record.panel import SHOWN, build_record
from addb_viewer.app.solve.controller import show_progress, stop
from addb_viewer.app.subjects.root_folder import leads_out
from addb_viewer.app.subjects.shared_subject import RECORDING
from addb_viewer.recordings.recording import file_of
from solver.errors import SolverError

FOLDER, SESSIONS = "recordings", "sessions"  # in the results folder
KINDS = (".html", ".rrd", ".mcap")


class RecordDesk:
    """What one reviewer sees of the subject's recordings."""

    def __init__(self, gui: viser.GuiApi, tab: viser.GuiTabHandle, place: Place, notices: Notices) -> None:
        self.place, self.notices = place, notices
        self.panel = build_record(gui, tab)
        self._listed: dict[str, Path] = {}
        for button, kind in zip(self.panel.writing, KINDS, strict=True):
            button.on_click(notices.in_order("Recording", partial(self.write, kind)))
        self.panel.cancel.on_click(notices.in_order("Cancelling", self._cancel))
        self.panel.download.on_click(notices.in_order("Downloading", self.download))
        self.panel.log.on_update(notices.in_order("Logging", lambda: self.log(self.panel.log.value)))

    def write(self, kind: str) -> None:
        """Write the fit on the screen into a file, in place of the one before.

        Args:
            kind: how the file's name ends, of `KINDS`.
        """
        replay = self.place.replay
        trial = replay.name if replay is not None and self.panel.trials.value == SHOWN else None
        self.place.room.record([self._file(kind, trial)], trial, self.place.author())

    def download(self) -> None:
        """Send the chosen file to the browser."""
        file = self._listed.get(str(self.panel.which.value))
        if file is None or not file.is_file() or leads_out(file, self.place.room.results):
            self.show()
            raise SolverError("the file is not there any more")
        self.notices.client.send_file_download(file.name, file.read_bytes(), save_immediately=True)

    def log(self, on: bool) -> None:
        """Begin or end the log of the session, for everybody who looks at this subject."""
        try:
            if on:
                self.place.room.begin_log()
            else:
                self.place.room.end_log()
        finally:
            self.show()

    def toggle_log(self) -> None:
        """Begin the log, or end it."""
        self.log(self.place.room.log is None)

    def show(self) -> None:
        """Put what lies on the disk, and what is being written, on the screen."""
        panel, room = self.panel, self.place.room
        lying = _newest_first(room.results / FOLDER)
        found = [file for file in lying if not leads_out(file, room.results)]
        self._listed = {file.name: file for file in found}
        panel.written.content = written_html(found, [file for file in lying if file not in found])
        panel.which.visible = panel.download.visible = bool(found)
        names = tuple(self._listed) or ("–",)
        if panel.which.options != names:
            panel.which.options = names
            put(panel.which, names[0])
        put(panel.log, room.log is not None)
        ended = next(iter(_newest_first(room.results / SESSIONS)), None)
        panel.log_status.content = log_html(None if room.log is None else room.log.file, ended)
        self._progress(room.bench.progress)

    def progressed(self, progress: Progress) -> None:
        """Something is at work."""
        self._progress(progress)

    def ended(self, task: Task, outcome: Outcome) -> None:
        """Nothing is any more."""
        self.show()
        if task.doing != RECORDING:
            return
        if outcome.cancelled:
            self.notices.tell("Cancelled", "Nothing was written.", "gray")
        elif not outcome.succeeded:
            self.notices.failed("Recording", outcome.error or "it ended without a word")
        else:
            name = Path(outcome.said.strip().splitlines()[-1]).name
            self.notices.tell("Written", f"{name}: listed in Record, with its folder and a download.")

    def _cancel(self) -> None:
        stop(self.place)

    def _file(self, kind: str, trial: str | None) -> Path:
        room = self.place.room
        parts = [room.subject.name]
        if trial is not None:
            parts.append(trial)
        if room.new is not None:
            parts.append(f"solve {room.new.number}")
        return room.results / FOLDER / (file_of(" ".join(parts)) + kind)

    def _progress(self, progress: Progress | None) -> None:
        panel, busy = self.panel, progress is not None
        panel.bar.visible = panel.status.visible = panel.cancel.visible = busy
        for button in panel.writing:
            button.visible = not busy
        if progress is not None:
            show_progress(panel.bar, panel.status, progress)


def _newest_first(folder: Path) -> list[Path]:
    if not folder.is_dir():
        return []
    files = [file for file in folder.iterdir() if file.suffix in KINDS and not file.name.startswith(".")]
    return sorted(
        (file for file in files if file.is_file()), key=lambda file: file.lstat().st_mtime, reverse=True
    )
