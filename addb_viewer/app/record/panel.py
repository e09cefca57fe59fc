"""The Record panel: the fit on the screen as a report or for other viewers, and the log of the session."""

from dataclasses import dataclass
from typing import Any

import viser

ALL, SHOWN = "all", "the one on the screen"


@dataclass(frozen=True)
class RecordPanel:
    """Handles of the panel."""

    trials: viser.GuiDropdownHandle[str]
    report: viser.GuiButtonHandle
    rrd: viser.GuiButtonHandle
    mcap: viser.GuiButtonHandle
    cancel: viser.GuiButtonHandle
    bar: Any  # viser exports no name for its class
    status: viser.GuiHtmlHandle
    written: viser.GuiHtmlHandle
    which: viser.GuiDropdownHandle[str]
    download: viser.GuiButtonHandle
    log: viser.GuiCheckboxHandle
    log_status: viser.GuiHtmlHandle

    @property
    def writing(self) -> tuple[viser.GuiButtonHandle, ...]:
        """The buttons that write a file."""
        return self.report, self.rrd, self.mcap


def build_record(gui: viser.GuiApi, tab: viser.GuiTabHandle) -> RecordPanel:
    """Lay out the panel; nothing is bound to anything yet."""
    with tab:
        with gui.add_folder("The fit on the screen as a file"):
            trials = gui.add_dropdown("Trials", (ALL, SHOWN))
            report = gui.add_button(
                "Write a report (.html)",
                icon=viser.Icon.REPORT,
                hint="One page to hand over: usable frames, bounds, diagnosis, and the motion to play",
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
        with gui.add_folder("Log of the session"):
            log = gui.add_checkbox("Write it", False, hint="For all who look at this subject")
            log_status = gui.add_html("")
    return RecordPanel(
        trials, report, rrd, mcap, cancel, bar, status, written, which, download, log, log_status
    )
