"""A picture or a film of the scene in one browser, which keeps it as a file."""

import base64
import contextlib
import io
import queue
import re
import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from jaxtyping import UInt8
from PIL import Image

from addb_viewer.app.scene.camera import eye_of
from addb_viewer.app.shell.session import Session
from addb_viewer.trial_view.replay import Replay
from annotations.review_errors import ReviewError

PATIENCE_S = 60.0  # for the browser to draw one picture; for a film, beside the time that it lasts
LONGEST_S = 30.0  # of a film
FASTEST_HZ = 60.0  # pictures of a film: more than screens show are left out
FILM_PX = 1280  # largest width of a film
QUALITY = 95  # of JPEG's hundred, on the way to the browser
LONGEST = 200  # characters of what a browser says
SHARPER = 2  # pixels of a picture for one of the page


@dataclass(frozen=True)
class Film:
    """Frames of a trial in the order in which they are shown."""

    frames: tuple[int, ...]
    rate: float  # [Hz] of the pictures


def film_of(start: int, end: int, rate: float, speed: float) -> Film:
    """Every n-th frame of start to end − 1, n as small as screens can follow, so that times are exact.

    Args:
        start: first frame.
        end: the first frame after it.
        rate: of the trial [Hz].
        speed: in units of real time; negative backwards.
    """
    every = int(np.ceil(rate * abs(speed) / FASTEST_HZ - 1e-9))
    frames = range(start, end, every)
    return Film(tuple(frames if speed > 0 else reversed(frames)), rate * abs(speed) / every)


class Capturing:
    """Draws frames and fetches what the browser shows of them, in a thread of its own."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._answers: queue.Queue[Any] = queue.Queue(maxsize=1)
        session.channel.on("filmed", self._answered)

    def picture(self) -> None:
        """The scene as it is seen now, twice as sharp, without ground."""
        replay, frame = self._replay(), self._session.frame
        self._begin(partial(self._picture, replay, frame))

    def film(self) -> None:
        """The selected frames, else the trial, as a film at the playing speed; once more, and it ends."""
        if self._thread is not None and self._thread.is_alive():
            self._stop.set()
            return
        s, replay = self._session, self._replay()
        start, end = s.review.chosen or (0, replay.frames)
        film = film_of(start, end, replay.rate, s.playback.position.speed)
        if len(film.frames) > LONGEST_S * film.rate:
            lasts = f"{len(film.frames) / film.rate:.0f} s, and can last {LONGEST_S:.0f} s"
            raise ReviewError(f"it would last {lasts}; select a shorter range, or play faster")
        s.playback.pause()
        self._begin(partial(self._film, replay, film))

    def _begin(self, work: Callable[[], None]) -> None:
        if self._thread is not None and self._thread.is_alive():
            raise ReviewError("a picture or film is being made")
        self._stop.clear()
        guarded = self._session.notices.guard("Saving what the scene shows", work)
        self._thread = threading.Thread(target=guarded, name="capturing", daemon=True)
        self._thread.start()

    def _picture(self, replay: Replay, frame: int) -> None:
        width, height = self._size()
        rgba = self._drawn(replay, frame, (SHARPER * width, SHARPER * height), "png")
        content, name = _encoded(rgba, "PNG", optimize=True), f"{_safe(replay.name)}-{frame}.png"
        self._session.client.send_file_download(name, content, save_immediately=True)
        self._tell_saved(name, len(content))

    def _film(self, replay: Replay, film: Film) -> None:
        """Hand the browser one picture after the other; with the last one it makes the film."""
        s, (width, height), count = self._session, self._size(), len(film.frames)
        scale = min(1.0, FILM_PX / width)
        size = 2 * round(scale * width / 2), 2 * round(scale * height / 2)  # H.264 takes no odd ones
        name = f"{_safe(replay.name)}-{min(film.frames)}-{max(film.frames)}"
        asked = {"count": count, "width": size[0], "height": size[1], "rate": film.rate, "name": name}
        s.notices.tell("The scene is being saved", f"{count} pictures; the same button or command ends it.")
        self._answers = queue.Queue(maxsize=1)
        answer: dict[str, Any] = {}
        try:
            for number, frame in enumerate(film.frames):
                if self._stop.is_set():
                    s.notices.tell("Nothing was saved", "It was ended.")
                    return
                rgb = self._drawn(replay, frame, size, "jpeg")[:, :, :3]
                jpeg = base64.b64encode(_encoded(rgb, "JPEG", quality=QUALITY)).decode()
                s.channel.show("filming", {**asked, "number": number, "jpeg": jpeg})
                answer = self._answer(number, count / film.rate)
        finally:
            s.channel.show("filming", None)
            s.playback.redraw()
        match answer:
            case {"name": str(saved), "bytes": int(size_bytes)}:
                self._tell_saved(saved[:LONGEST], size_bytes)

    def _answer(self, number: int, lasts_s: float) -> dict[str, Any]:
        """What the browser says of a picture that it has taken."""
        try:
            answer = self._answers.get(timeout=PATIENCE_S + lasts_s)
        except queue.Empty:
            raise ReviewError("the browser does not take the pictures; try again") from None
        match answer:
            case {"error": str(error)}:
                raise ReviewError(error[:LONGEST])
            case {"number": found} if found == number:
                return dict(answer)
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

    def _tell_saved(self, name: str, size_bytes: int) -> None:
        self._session.notices.tell(
            "Saved", f"{name}, {size_bytes / 2**20:.1f} MB, in the browser's downloads."
        )

    def _size(self) -> tuple[int, int]:
        width, height = eye_of(self._session.client.camera, self._session.picture).size
        return round(float(width)), round(float(height))

    def _replay(self) -> Replay:
        if self._session.replay is None:
            raise ReviewError("no trial is open")
        return self._session.replay


def _encoded(pixels: UInt8[np.ndarray, "height width channels"], kind: str, **options: Any) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, kind, **options)
    return stream.getvalue()


def _safe(name: str) -> str:
    """A trial's name as a file's."""
    return re.sub(r"[^\w.-]+", "_", name)
