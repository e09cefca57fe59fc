"""The video beside the scene in one browser: which one it is, and how its clock runs."""

import html
from pathlib import Path

import viser

from addb_viewer.app.page.handles import put
from addb_viewer.app.page.notices import Notices
from addb_viewer.app.page.screen import Screen
from addb_viewer.app.security.file_parts import ServedFile
from addb_viewer.app.subjects.videos import (
    FASTEST,
    LARGEST_DRIFT,
    LARGEST_S,
    PACKINGS,
    SLOWEST,
    TrialVideo,
    VideoError,
    advice,
    keep_video,
    kept_video,
    place_of,
    videos_in,
)
from addb_viewer.trial_view.html_pieces import boxed

NONE = "none"


class VideoController:
    """What one reviewer sees of the videos of the subject."""

    def __init__(self, gui: viser.GuiApi, tab: viser.GuiTabHandle, screen: Screen, notices: Notices) -> None:
        """Lay it out below what the tab has."""
        self.screen, self.notices = screen, notices
        self._shown: TrialVideo | None = None
        with tab, gui.add_folder("Video", expand_by_default=False) as self.folder:
            self.which = gui.add_dropdown("File", (NONE,), hint="Of the subject's folder, beside this trial")
            self.offset = gui.add_number(
                "Offset [s]", 0.0, min=-LARGEST_S, max=LARGEST_S, step=0.001,
                hint="Time in the video at the trial's first frame",
            )  # fmt: skip
            self.rate = gui.add_number(
                "Rate", 1.0, min=SLOWEST, max=FASTEST, step=0.001,
                hint="Seconds of video a second of the trial: 8 for slow motion of 240 Hz",
            )  # fmt: skip
            self.drift = gui.add_number(
                "Drift [ms/min]", 0.0, min=-LARGEST_DRIFT, max=LARGEST_DRIFT, step=0.1,
                hint="By which the video's clock gains on the trial's",
            )  # fmt: skip
            self.told = gui.add_html("")
        self.which.on_update(notices.in_order("Showing the video", self._chosen))
        for field in (self.offset, self.rate, self.drift):
            field.on_update(notices.in_order("Adjusting the video", self._adjusted))

    def open(self) -> None:
        """Another trial is on the screen: its video comes with it."""
        folder, trial = self._place()
        try:
            found = videos_in(folder)
            video = kept_video(folder, trial)
            shown = video if video is not None and video.file in found else None
        except VideoError as error:
            self._show(None, str(error))
            return
        self.which.options = (NONE, *found)
        self._fill(shown)
        told = f"{video.file}: is not in the subject's folder any more." if video and not shown else ""
        self._show(shown, told or ("" if found else "The subject's folder has no video."))

    def _chosen(self) -> None:
        folder, trial = self._place()
        name = str(self.which.value)
        if name == (NONE if self._shown is None else self._shown.file):
            return
        kept = kept_video(folder, trial)
        video = None if name == NONE else kept if kept and kept.file == name else TrialVideo(name)
        try:
            if video is not None:
                place_of(folder, video.file)
            keep_video(folder, trial, video)
        except VideoError as error:  # what is not played is not kept
            self._fill(self._shown)
            self.told.content = boxed(html.escape(str(error)))
            return
        self._fill(video)
        self._show(video)

    def _adjusted(self) -> None:
        if self._shown is None:
            return
        folder, trial = self._place()
        video = TrialVideo(
            self._shown.file, float(self.offset.value), float(self.rate.value), float(self.drift.value)
        )
        if video != self._shown:
            keep_video(folder, trial, video)
            self._show(video)

    def _fill(self, video: TrialVideo | None) -> None:
        self._shown = video
        of = video or TrialVideo(NONE)
        put(self.which, of.file)
        put(self.offset, of.offset_s)
        put(self.rate, of.rate)
        put(self.drift, of.drift_ms_per_min)

    def _show(self, video: TrialVideo | None, told: str = "") -> None:
        self._shown = video
        replay, channel = self.screen.replay, self.screen.channel
        shown = None
        if video is not None and replay is not None:
            try:
                file = place_of(self._place()[0], video.file)
            except VideoError as error:
                told = str(error)
            else:
                url = channel.serve_file(ServedFile(file, PACKINGS[file.suffix.lower()]))
                shown = {"url": url, "name": video.file, "offset": video.offset_s, "scale": video.scale}
                shown |= {"rate": replay.rate, "advice": advice(file)}
        if shown is None:
            channel.serve_file(None)
        self.told.content = boxed(html.escape(told)) if told else ""
        channel.show("video", shown)

    def _place(self) -> tuple[Path, str]:
        replay = self.screen.replay
        return self.screen.shared.subject.folder, "" if replay is None else replay.name
