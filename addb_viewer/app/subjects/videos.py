"""Videos of a subject: which files there are, which goes with which trial, and how its clock runs."""

import json
import math
import os
import threading
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from addb_viewer.jobs.root_folder import leads_out
from solver.capture.atomic import write_whole
from solver.common.errors import CaptureError
from solver.common.small_files import json_of

PACKINGS = {".mp4": "video/mp4", ".m4v": "video/mp4", ".mov": "video/mp4", ".webm": "video/webm"}
OTHERS = (".avi", ".mkv", ".wmv", ".mpg", ".mpeg", ".mts", ".flv", ".3gp")  # no browser plays them
KEPT = "videos.json"  # in the subject's folder
MS_A_MINUTE = 60_000.0
SLOWEST, FASTEST = 0.01, 100.0  # seconds of video a second of the recording
LARGEST_S, LARGEST_DRIFT = 86_400.0, 10_000.0  # offset [s] and drift [ms a minute] that are taken
_ONE_WRITER = threading.Lock()


class VideoError(CaptureError):
    """A video cannot be shown; says what to do."""


@dataclass(frozen=True)
class TrialVideo:
    """The video beside one trial, and how its clock runs."""

    file: str  # below the subject's folder, with slashes
    offset_s: float = 0.0  # time in the video at the trial's first frame
    rate: float = 1.0  # seconds of video a second of the recording: 8 where 240 pictures a second play as 30
    drift_ms_per_min: float = 0.0  # by which the video's clock gains

    def time_s(self, seconds: float) -> float:
        """In the video.

        Args:
            seconds: since the trial's first frame.
        """
        return self.offset_s + self.scale * seconds

    @property
    def scale(self) -> float:
        """Seconds of video a second of the recording, the drift included."""
        return self.rate * (1.0 + self.drift_ms_per_min / MS_A_MINUTE)


def videos_in(folder: Path) -> list[str]:
    """All videos below a subject's folder, also those that browsers do not play; no links that lead out."""
    found = []
    for here, folders, files in os.walk(folder):  # which does not follow links
        folders[:] = [name for name in folders if not name.startswith(".")]
        for name in files:
            path = Path(here, name)
            if path.suffix.lower() in (*PACKINGS, *OTHERS) and not leads_out(path, folder):
                found.append(path.relative_to(folder).as_posix())
    return sorted(found)


def place_of(folder: Path, video: str) -> Path:
    """The file of a video.

    Raises:
        VideoError: it is not in the subject's folder, or no browser plays such files.
    """
    if video not in videos_in(folder):
        raise VideoError(f"{video}: is not in the subject's folder any more")
    file = folder / video
    if file.suffix.lower() not in PACKINGS:
        raise VideoError(f"{file.name}: browsers play MP4, MOV and WebM. {advice(file)}")
    return file


def advice(file: Path) -> str:
    """How to make a file that is played; the pictures and their times stay."""
    made = f"{file.stem}.h264.mp4"
    return f'To convert it: ffmpeg -i "{file.name}" -c:v libx264 -crf 18 -pix_fmt yuv420p -an "{made}"'


def kept_video(folder: Path, trial: str) -> TrialVideo | None:
    """The one that goes with a trial; None where nobody has said.

    Raises:
        VideoError: what was kept cannot be read.
    """
    kept = _kept(folder).get(trial)
    return None if kept is None else _trial_video(folder, kept)


def keep_video(folder: Path, trial: str, video: TrialVideo | None) -> None:
    """Say which video goes with a trial from now on; None: none does.

    Raises:
        VideoError: what was kept cannot be read; it stays as it is.
    """
    with _ONE_WRITER:  # people at other trials write the same file
        kept = {**_kept(folder)}
        kept.pop(trial, None)
        if video is not None:
            kept[trial] = asdict(_checked(video))
        text = json.dumps({"trials": kept}, indent=2, ensure_ascii=False, sort_keys=True)
        write_whole(folder / KEPT, text + "\n")


def _kept(folder: Path) -> Mapping[str, Any]:
    file = folder / KEPT
    if not file.exists():
        return {}
    try:
        trials = json_of(file.read_text(encoding="utf-8"))["trials"]
        return {str(name): dict(video) for name, video in trials.items()}
    except (OSError, ValueError, LookupError, TypeError, AttributeError) as error:
        raise VideoError(f"{file}: cannot be read ({error}). Correct it, or move it away.") from error


def _trial_video(folder: Path, kept: Mapping[str, Any]) -> TrialVideo:
    try:
        video = TrialVideo(
            str(kept["file"]), float(kept["offset_s"]), float(kept["rate"]), float(kept["drift_ms_per_min"])
        )
    except (LookupError, TypeError, ValueError) as error:
        raise VideoError(
            f"{folder / KEPT}: cannot be read ({error}). Correct it, or move it away."
        ) from error
    return _checked(video)


def _checked(video: TrialVideo) -> TrialVideo:
    """Raises VideoError where a clock is none."""
    for value, low, high, what in (
        (video.offset_s, -LARGEST_S, LARGEST_S, "Offset"),
        (video.rate, SLOWEST, FASTEST, "Rate"),
        (video.drift_ms_per_min, -LARGEST_DRIFT, LARGEST_DRIFT, "Drift"),
    ):
        if not (math.isfinite(value) and low <= value <= high):
            raise VideoError(f"{what} {value:g}: it can be {low:g} to {high:g}.")
    return video
