"""A picture or a clip of the scene in one browser, as a file that is sent to it."""

import base64
import contextlib
import queue
import re
import threading
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
from jaxtyping import UInt8

from addb_viewer.app.scene.camera import eye_of
from addb_viewer.app.scene.clips import LONGEST_S, Clip, clip_of, film_of, gif, jpeg, png
from addb_viewer.app.scene.mp4 import Coded, Coding, mp4
from addb_viewer.app.shell.session import Session
from addb_viewer.trial_view.replay import Replay
from annotations.errors import ReviewError

PATIENCE_S = 60.0  # for the browser to draw one picture
CLIP_PX, FILM_PX = 640, 1280  # largest width of a GIF, and of an MP4
LONGEST = 200  # characters of what a browser says
SHARPER = 2  # pixels of a picture for one of the page


class Capturing:
    """Draws frames and fetches what the browser shows of them, in a thread of its own."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._answers: queue.Queue[Any] = queue.Queue(maxsize=1)
        session.channel.on("coded", self._answered)

    def picture(self) -> None:
        """The scene as it is seen now, twice as sharp, without ground."""
        replay, frame = self._replay(), self._session.frame
        self._begin(partial(self._picture, replay, frame))

    def clip(self) -> None:
        """The selected frames, else the trial, as a GIF at the playing speed; once more, and it ends."""
        self._record(clip_of, self._clip)

    def film(self) -> None:
        """The same as MP4, which the browser codes."""
        self._record(film_of, self._film)

    def _record(
        self, timing: Callable[[int, int, float, float], Clip], work: Callable[[Replay, Clip], None]
    ) -> None:
        if self._thread is not None and self._thread.is_alive():
            self._stop.set()
            return
        s, replay = self._session, self._replay()
        start, end = s.review.chosen or (0, replay.frames)
        shown = timing(start, end, replay.rate, s.playback.position.speed)
        if len(shown.frames) > LONGEST_S * shown.rate:
            lasts = f"{len(shown.frames) / shown.rate:.0f} s, and can last {LONGEST_S:.0f} s"
            raise ReviewError(f"it would last {lasts}; select a shorter range, or play faster")
        s.playback.pause()
        self._begin(partial(work, replay, shown))

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

    def _clip(self, replay: Replay, shown: Clip) -> None:
        pictures = list(self._pictures(replay, shown, self._scaled(CLIP_PX)))
        if not self._stop.is_set():
            self._send(_name(replay, shown, "gif"), gif(pictures))

    def _film(self, replay: Replay, shown: Clip) -> None:
        s, (width, height) = self._session, self._scaled(FILM_PX)
        size = 2 * (width // 2), 2 * (height // 2)  # H.264 takes no odd ones
        coded: list[Coded] = []
        description, code = b"", "vp09"
        self._answers = queue.Queue(maxsize=1)
        try:
            for number, picture in enumerate(self._pictures(replay, shown, size)):
                asked = {"number": number, "width": size[0], "height": size[1], "rate": shown.rate}
                s.channel.show("coding", {**asked, "jpeg": base64.b64encode(jpeg(picture)).decode()})
                answer = self._answer(number)
                coded.append(Coded(base64.b64decode(answer["data"]), answer["alone"]))
                description = base64.b64decode(answer["description"])
                code = "avc1" if answer["codec"] == "avc1" else "vp09"
        finally:
            s.channel.show("coding", None)
        if not self._stop.is_set():
            film = mp4(coded, Coding(code, size, shown.rate, description))
            self._send(_name(replay, shown, "mp4"), film)

    def _pictures(
        self, replay: Replay, shown: Clip, size: tuple[int, int]
    ) -> Iterator[UInt8[np.ndarray, "height width 3"]]:
        """One after the other, until it is ended."""
        s, count = self._session, len(shown.frames)
        s.notices.tell("The scene is being saved", f"{count} pictures; the same button or command ends it.")
        for frame in shown.frames:
            if self._stop.is_set():
                s.notices.tell("Nothing was saved", "It was ended.")
                break
            yield self._drawn(replay, frame, size, "jpeg")[:, :, :3]
        s.playback.redraw()

    def _answer(self, number: int) -> dict[str, Any]:
        """The picture that the browser has coded."""
        answer = self._answers.get(timeout=PATIENCE_S)
        match answer:
            case {"number": found, "data": str(), "description": str(), "codec": str(), "alone": bool()}:
                if found == number:
                    return dict(answer)
            case {"error": str(error)}:
                raise ReviewError(error[:LONGEST])
        raise ReviewError("the browser sent something else than the picture; try again")

    def _answered(self, answer: Any) -> None:
        with contextlib.suppress(queue.Full):  # nobody has asked
            self._answers.put_nowait(answer)

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

    def _scaled(self, most: int) -> tuple[int, int]:
        width, height = self._size()
        scale = min(1.0, most / width)
        return round(scale * width), round(scale * height)

    def _size(self) -> tuple[int, int]:
        width, height = eye_of(self._session.client.camera, self._session.picture).size
        return round(float(width)), round(float(height))

    def _replay(self) -> Replay:
        if self._session.replay is None:
            raise ReviewError("no trial is open")
        return self._session.replay


def _name(replay: Replay, shown: Clip, ending: str) -> str:
    return f"{replay.name}-{min(shown.frames)}-{max(shown.frames)}.{ending}"
