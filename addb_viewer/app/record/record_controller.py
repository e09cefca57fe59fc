"""Recordings from one browser: files of the fit on the screen."""

import html
from collections.abc import Sequence
from datetime import datetime
from functools import partial
from pathlib import Path

import viser

from addb_viewer.app.jobs.job_queue import Outcome, Task
from addb_viewer.app.page.handles import put
from addb_viewer.app.page.notices import Notices
from addb_viewer.app.page.screen import Screen
from addb_viewer.app.subjects.shared_subject import RECORDING
from addb_viewer.jobs.root_folder import leads_out
from addb_viewer.trial_view.html_pieces import boxed
from addb_viewer.trial_view.recorded_subject import ON_ONE_PAGE, file_of
from solver.common.errors import SolverError

ALL, SHOWN = "all", "the one on the screen"


class RecordPanel:
    """Handles of the panel."""

    def __init__(self, gui: viser.GuiApi, tab: viser.GuiTabHandle) -> None:
        """Lay out the panel; nothing is bound to anything yet."""
        with tab, gui.add_folder("The fit on the screen as a file"):
            self.trials = gui.add_dropdown("Trials", (ALL, SHOWN))
            report = gui.add_button(
                "Write a report (.html)",
                icon=viser.Icon.REPORT,
                hint="One page to hand over: usable frames, bounds, diagnosis, and the motion to play",
            )
            one_page = gui.add_button(
                "Write the form on one page (.html)",
                icon=viser.Icon.FILE_CHECK,
                hint="One A4 page for a folder: what is usable, bounds, causes, who reviewed, a line to sign",
            )
            rrd = gui.add_button(
                "Write for rerun (.rrd)",
                icon=viser.Icon.TIMELINE,
                hint="Scene, residuals, flags, causes, before and after",
            )
            mcap = gui.add_button(
                "Write for Foxglove (.mcap)",
                icon=viser.Icon.FILE_EXPORT,
                hint="The same, with settings, model and review attached",
            )
            self.written = gui.add_html("")
            self.which = gui.add_dropdown("File", ("–",), visible=False)
            self.download = gui.add_button(
                "Download",
                icon=viser.Icon.DOWNLOAD,
                visible=False,
                color="gray",
                hint="To the machine of this browser",
            )
        self.writing = (report, one_page, rrd, mcap)  # the buttons that write a file


OPENED_WITH = {
    ".html": "any browser, also without a network",
    ".rrd": "rerun {}",
    ".mcap": "Foxglove, or any reader of MCAP",
}
MEGABYTE = 1e6
BREAKS = "overflow-wrap:anywhere"


def written_html(files: Sequence[Path], refused: Sequence[Path] = ()) -> str:
    """The files on the disk, newest first: where, when, how large, and what opens them.

    Args:
        files: of the folder, newest first.
        refused: links in it that lead elsewhere.
    """
    links = "".join(
        boxed(f"<div style='{BREAKS}'>{html.escape(link.name)} leads out of the folder: not sent.</div>")
        for link in refused
    )
    if not files:
        return boxed("No files yet.") + links
    rows = []
    for file in files:
        about = file.stat()
        when = datetime.fromtimestamp(about.st_mtime).astimezone()
        opened = OPENED_WITH.get(file.suffix, "").format(html.escape(f'"{file.name}"'))
        rows.append(
            f"<div style='margin:.35em 0;{BREAKS}'><b>{html.escape(file.name)}</b>"
            f"<div>{when:%d %b %H:%M} · {about.st_size / MEGABYTE:.1f} MB · {opened}</div></div>"
        )
    place = html.escape(str(files[0].parent))
    return boxed(f"<div style='{BREAKS}'>In {place}:</div>{''.join(rows)}") + links


FOLDER = "recordings"  # in the results folder
KINDS = (".html", ON_ONE_PAGE, ".rrd", ".mcap")  # of files that the buttons write, in their order


class RecordController:
    """What one reviewer sees of the subject's recordings."""

    def __init__(self, gui: viser.GuiApi, tab: viser.GuiTabHandle, screen: Screen, notices: Notices) -> None:
        self.screen, self.notices = screen, notices
        self.panel = RecordPanel(gui, tab)
        self._listed: dict[str, Path] = {}
        for button, kind in zip(self.panel.writing, KINDS, strict=True):
            button.on_click(notices.in_order("Recording", partial(self.write, kind)))
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
        """Put what lies on the disk on the screen."""
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

    def _file(self, kind: str, trial: str | None) -> Path:
        shared = self.screen.shared
        parts = [shared.subject.name]
        if trial is not None:
            parts.append(trial)
        if shared.fits.new is not None:
            parts.append(f"solve {shared.fits.new.number}")
        return shared.results / FOLDER / (file_of(" ".join(parts)) + kind)


def _newest_first(folder: Path) -> list[Path]:
    if not folder.is_dir():
        return []
    files = [
        file for file in folder.iterdir() if file.suffix in OPENED_WITH and not file.name.startswith(".")
    ]
    return sorted(
        (file for file in files if file.is_file()), key=lambda file: file.lstat().st_mtime, reverse=True
    )
