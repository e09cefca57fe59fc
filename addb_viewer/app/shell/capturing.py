"""A picture or a clip of the scene in one browser, as a file that is sent to it."""

import re
import threading
from collections.abc import Callable
from functools import partial

import numpy as np
from jaxtyping import UInt8

from addb_viewer.app.scene.camera import eye_of
from addb_viewer.app.scene.clips import MOST, STEP_S, clip_of, gif, png
from addb_viewer.app.shell.session import Session
from addb_viewer.app.trial.replay import Replay
from annotations.errors import ReviewError

PATIENCE_S = 60.0  # for the browser to draw one picture
LARGEST_PX = 640  # width of a clip
SHARPER = 2  # pixels of a picture for one of the page


class Capturing:
    """Draws frames and fetches what the browser shows of them, in a thread of its own."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    def picture(self) -> None:
        """The scene as it is seen now, twice as sharp, without ground."""
        replay, frame = self._replay(), self._session.frame
        self._begin(partial(self._picture, replay, frame))

    def clip(self) -> None:
        """The selected frames, else the trial, at the playing speed; where one is being made, end that."""
        if self._thread is not None and self._thread.is_alive():
            self._stop.set()
            return
        s, replay = self._session, self._replay()
        start, end = s.review.chosen or (0, replay.frames)
        shown = clip_of(start, end, replay.rate, s.playback.position.speed)
        if len(shown.frames) > MOST:
            raise ReviewError(
                f"{len(shown.frames)} pictures are too many; select a range of at most "
                f"{MOST * STEP_S * abs(shown.speed):.0f} s, or play faster"
            )
        s.playback.pause()
        self._begin(partial(self._clip, replay, shown.frames))

    def _begin(self, work: Callable[[], None]) -> None:
        if self._thread is not None and self._thread.is_alive():
            raise ReviewError("a picture or clip is being made")
        self._stop.clear()
        guarded = self._session.notices.guard("Saving what the scene shows", work)
        self._thread = threading.Thread(target=guarded, name="capturing", daemon=True)
        self._thread.start()

    def _picture(self, replay: Replay, frame: int) -> None:
        width, height = self._size()
        rgba = self._drawn(replay, frame, (SHARPER * width, SHARPER * height), "png")
        self._send(f"{replay.name}-{frame}.png", png(rgba))

    def _clip(self, replay: Replay, frames: tuple[int, ...]) -> None:
        s, (width, height) = self._session, self._size()
        scale = min(1.0, LARGEST_PX / width)
        size = round(scale * width), round(scale * height)
        s.notices.tell("A clip is being made", f"{len(frames)} pictures; the same button or command ends it.")
        pictures = []
        for frame in frames:
            if self._stop.is_set():
                s.playback.redraw()
                s.notices.tell("No clip", "It was ended.")
                return
            pictures.append(self._drawn(replay, frame, size, "jpeg")[:, :, :3])
        s.playback.redraw()
        self._send(f"{replay.name}-{min(frames)}-{max(frames)}.gif", gif(pictures))

    def _drawn(
        self, replay: Replay, frame: int, size: tuple[int, int], kind: str
    ) -> UInt8[np.ndarray, "height width channels"]:
        """One frame as the browser draws it; nothing else is drawn meanwhile."""
        s = self._session
        with s.drawing:
            if s.replay is not replay:
                raise ReviewError("another trial is on the screen")
            s.scene.draw(frame, eye_of(s.client.camera, s.picture))
            width, height = size
            return s.client.get_render(
                height, width, transport_format="png" if kind == "png" else "jpeg", timeout=PATIENCE_S
            )

    def _send(self, name: str, content: bytes) -> None:
        safe = re.sub(r"[^\w.-]+", "_", name)
        self._session.client.send_file_download(safe, content, save_immediately=True)
        self._session.notices.tell(
            "Saved", f"{safe}, {len(content) / 2**20:.1f} MB, in the browser's downloads."
        )

    def _size(self) -> tuple[int, int]:
        width, height = eye_of(self._session.client.camera, self._session.picture).size
        return round(float(width)), round(float(height))

    def _replay(self) -> Replay:
        if self._session.replay is None:
            raise ReviewError("no trial is open")
        return self._session.replay
