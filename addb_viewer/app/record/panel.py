"""The Record panel: the fit on the screen as a report or for other viewers."""

import html
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import viser

from addb_viewer.trial_view.html_pieces import boxed

ALL, SHOWN = "all", "the one on the screen"


@dataclass(frozen=True)
class RecordPanel:
    """Handles of the panel."""

    trials: viser.GuiDropdownHandle[str]
    report: viser.GuiButtonHandle
    one_page: viser.GuiButtonHandle
    rrd: viser.GuiButtonHandle
    mcap: viser.GuiButtonHandle
    cancel: viser.GuiButtonHandle
    bar: Any  # viser exports no name for its class
    status: viser.GuiHtmlHandle
    written: viser.GuiHtmlHandle
    which: viser.GuiDropdownHandle[str]
    download: viser.GuiButtonHandle

    @property
    def writing(self) -> tuple[viser.GuiButtonHandle, ...]:
        """The buttons that write a file."""
        return self.report, self.one_page, self.rrd, self.mcap


def build_record(gui: viser.GuiApi, tab: viser.GuiTabHandle) -> RecordPanel:
    """Lay out the panel; nothing is bound to anything yet."""
    with tab, gui.add_folder("The fit on the screen as a file"):
        trials = gui.add_dropdown("Trials", (ALL, SHOWN))
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
        bar = gui.add_progress_bar(0.0, visible=False, animated=True)
        status = gui.add_html("", visible=False)
        cancel = gui.add_button("Cancel", icon=viser.Icon.X, visible=False, color="gray")
        written = gui.add_html("")
        which = gui.add_dropdown("File", ("–",), visible=False)
        download = gui.add_button(
            "Download",
            icon=viser.Icon.DOWNLOAD,
            visible=False,
            color="gray",
            hint="To the machine of this browser",
        )
    return RecordPanel(trials, report, one_page, rrd, mcap, cancel, bar, status, written, which, download)


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
