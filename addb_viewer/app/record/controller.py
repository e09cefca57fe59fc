"""Recordings from one browser: files of the fit on the screen."""

from functools import partial
from pathlib import Path

import viser

from addb_viewer.app.jobs.job_queue import Outcome, Task, TaskProgress
from addb_viewer.app.jobs.progress_html import show_progress
from addb_viewer.app.page.handles import put
from addb_viewer.app.page.notices import Notices
from addb_viewer.app.page.screen import Screen
from addb_viewer.app.record.panel import OPENED_WITH, SHOWN, build_record, written_html
from addb_viewer.app.solve.controller import stop
from addb_viewer.app.subjects.shared_subject import RECORDING
from addb_viewer.jobs.root_folder import leads_out
from addb_viewer.trial_view.recording import ON_ONE_PAGE, file_of
from solver.common.errors import SolverError

FOLDER = "recordings"  # in the results folder
KINDS = (".html", ON_ONE_PAGE, ".rrd", ".mcap")  # of files that the buttons write, in their order


class RecordController:
    """What one reviewer sees of the subject's recordings."""

    def __init__(self, gui: viser.GuiApi, tab: viser.GuiTabHandle, screen: Screen, notices: Notices) -> None:
        self.screen, self.notices = screen, notices
        self.panel = build_record(gui, tab)
        self._listed: dict[str, Path] = {}
        for button, kind in zip(self.panel.writing, KINDS, strict=True):
            button.on_click(notices.in_order("Recording", partial(self.write, kind)))
        self.panel.cancel.on_click(notices.in_order("Cancelling", self._cancel))
        self.panel.download.on_click(notices.in_order("Downloading", self.download))

    def write(self, kind: str) -> None:
        """Write the fit on the screen into a file, in place of the one before.

        Args:
            kind: how the file's name ends, of `KINDS`.
        """
        replay = self.screen.replay
        trial = replay.name if replay is not None and self.panel.trials.value == SHOWN else None
        self.screen.shared.record([self._file(kind, trial)], trial, self.screen.reviewer.author())

    def download(self) -> None:
        """Send the chosen file to the browser."""
        file = self._listed.get(str(self.panel.which.value))
        if file is None or not file.is_file() or leads_out(file, self.screen.shared.results):
            self.show()
            raise SolverError("the file is not there any more")
        self.notices.client.send_file_download(file.name, file.read_bytes(), save_immediately=True)

    def show(self) -> None:
        """Put what lies on the disk, and what is being written, on the screen."""
        panel, shared = self.panel, self.screen.shared
        lying = _newest_first(shared.results / FOLDER)
        found = [file for file in lying if not leads_out(file, shared.results)]
        self._listed = {file.name: file for file in found}
        panel.written.content = written_html(found, [file for file in lying if file not in found])
        panel.which.visible = panel.download.visible = bool(found)
        names = tuple(self._listed) or ("–",)
        if panel.which.options != names:
            panel.which.options = names
            put(panel.which, names[0])
        self._progress(shared.jobs.progress)

    def progressed(self, progress: TaskProgress) -> None:
        """Something is at work."""
        self._progress(progress)

    def ended(self, task: Task, outcome: Outcome) -> None:
        """Nothing is any more."""
        self.show()
        if task.doing != RECORDING:
            return
        if outcome.cancelled:
            self.notices.tell("Cancelled", "Nothing was written.", important=True)
        elif not outcome.succeeded:
            self.notices.failed("Recording", outcome.error or "it ended without a word")
        else:
            name = Path(outcome.said.strip().splitlines()[-1]).name
            self.notices.tell("Written", f"{name}: listed in Record, with its folder and a download.")

    def _cancel(self) -> None:
        stop(self.screen)

    def _file(self, kind: str, trial: str | None) -> Path:
        shared = self.screen.shared
        parts = [shared.subject.name]
        if trial is not None:
            parts.append(trial)
        if shared.fits.new is not None:
            parts.append(f"solve {shared.fits.new.number}")
        return shared.results / FOLDER / (file_of(" ".join(parts)) + kind)

    def _progress(self, progress: TaskProgress | None) -> None:
        panel, busy = self.panel, progress is not None
        panel.bar.visible = panel.status.visible = panel.cancel.visible = busy
        for button in panel.writing:
            button.visible = not busy
        if progress is not None:
            show_progress(panel.bar, panel.status, progress)


def _newest_first(folder: Path) -> list[Path]:
    if not folder.is_dir():
        return []
    files = [
        file for file in folder.iterdir() if file.suffix in OPENED_WITH and not file.name.startswith(".")
    ]
    return sorted(
        (file for file in files if file.is_file()), key=lambda file: file.lstat().st_mtime, reverse=True
    )
