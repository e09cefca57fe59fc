"""Where in the trial we are, and playing it in real time: one thread draws, everybody else only asks."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

SPEEDS = (-2.0, -1.0, -0.5, -0.25, 0.25, 0.5, 1.0, 2.0)  # J and L walk through them
PICTURES_PER_SECOND = 30.0  # what a software-rendered browser and a slow line can still take
HELD_S = 0.8  # before a loop runs on from the frame that it was begun to show
PICTURES_OF_ALL = 300.0  # a second, of all browsers together: about half of one core
LONGEST_WAIT_S = 0.05  # of a picture for a key: what a key asks for may take seconds


@dataclass(frozen=True)
class Position:
    """What the drawing thread shows."""

    frame: int
    playing: bool
    speed: float
    held: bool = False  # it will run on in a moment


class Pace:
    """How many pictures a second each browser gets: fewer where many play, so that keys still act at once."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._playing: set[int] = set()
        self._turn = threading.Lock()
        self._free = threading.Condition()
        self._pressed = 0  # keys that are being obeyed

    @contextmanager
    def turn(self) -> Iterator[None]:
        """Work that can wait: one browser after the other, and not while a key is being obeyed."""
        with self._turn:
            with self._free:
                self._free.wait_for(lambda: self._pressed == 0, LONGEST_WAIT_S)
            yield

    @contextmanager
    def first(self) -> Iterator[None]:
        """Work that somebody has just asked for by a key: it goes ahead of all that waits."""
        with self._free:
            self._pressed += 1
        try:
            yield
        finally:
            with self._free:
                self._pressed -= 1
                self._free.notify_all()

    def report(self, who: int, playing: bool) -> None:
        """Say whether a playback plays."""
        with self._lock:
            if playing:
                self._playing.add(who)
            else:
                self._playing.discard(who)

    @property
    def interval(self) -> float:
        """Least time between two pictures of one playback [s]."""
        return max(1.0 / PICTURES_PER_SECOND, len(self._playing) / PICTURES_OF_ALL)


class Playback:
    """The present frame of a trial. All methods may be called from any thread and return at once.

    Real time comes from the clock: a browser that cannot keep up skips frames, it never runs late.
    """

    def __init__(
        self,
        draw: Callable[[Position], None],
        clock: Callable[[], float] = time.perf_counter,
        pace: Pace | None = None,
    ) -> None:
        self._draw = draw
        self._clock = clock
        self._pace = pace or Pace()
        self._wake = threading.Condition(threading.RLock())
        self._frames, self._rate = 1, 1.0
        self._frame, self._speed, self._playing = 0.0, 1.0, False
        self._started_at, self._started_frame = 0.0, 0.0
        self._loop: tuple[int, int] | None = None  # frames that are played again and again
        self._dirty, self._stopped = False, False
        self._thread = threading.Thread(target=self._run, name="playback", daemon=True)

    def start(self) -> None:
        """Begin to draw."""
        self._thread.start()

    def stop(self) -> None:
        """End the thread."""
        with self._wake:
            self._stopped = True
            self._wake.notify_all()
        if self._thread.is_alive() and self._thread is not threading.current_thread():
            self._thread.join(timeout=5.0)

    def open(self, frames: int, rate: float, frame: int = 0) -> None:
        """Turn to a frame of another trial, paused."""
        with self._wake:
            self._frames, self._rate = max(frames, 1), rate
            self._frame, self._playing = float(min(max(frame, 0), self._frames - 1)), False
            self._loop = None
            self._changed()

    @property
    def frames(self) -> int:
        """Length of the trial."""
        return self._frames

    @property
    def position(self) -> Position:
        """Where we are now."""
        with self._wake:
            return self._position()

    def seek(self, frame: int) -> None:
        """Pause at a frame, or at the nearest one that exists."""
        with self._wake:
            self._playing, self._loop = False, None
            self._frame = float(min(max(frame, 0), self._frames - 1))
            self._changed()

    def step(self, frames: int) -> None:
        """Pause and move by that many frames."""
        with self._wake:
            self.seek(self._position().frame + frames)

    def step_seconds(self, seconds: float) -> None:
        """Pause and move by at least one frame."""
        with self._wake:
            sign = 1 if seconds > 0 else -1
            self.step(sign * max(1, round(abs(seconds) * self._rate)))

    def toggle(self) -> None:
        """Play or pause; at the end of the trial, play again from the beginning."""
        with self._wake:
            if self._playing:
                self.seek(self._position().frame)
            else:
                self._play(self._speed)

    def show_loop(self, start: int, end: int, frame: int) -> None:
        """Show a frame for a moment, then play frames start to end − 1, in which it is, again and again."""
        with self._wake:
            self.seek(frame)
            if end - start > 1:
                self._loop = start, end
                self._play(self._speed)
                self._started_at += HELD_S

    def end_loop(self) -> None:
        """Pause if a range is being played again and again."""
        with self._wake:
            if self._loop is not None:
                self.pause()

    def loop(self, start: int, end: int) -> None:
        """Play frames start to end − 1 again and again; pause where that is being done."""
        with self._wake:
            if self._playing and self._loop == (start, end):
                self.seek(self._position().frame)
                return
            frame = self._position().frame
            self._frame = float(frame if start <= frame < end else start)
            self._loop = start, end
            self._play(self._speed)

    def pause(self) -> None:
        """Stay here."""
        with self._wake:
            self.seek(self._position().frame)

    def faster(self) -> None:
        """L: play forwards, or one speed up."""
        with self._wake:
            self._play(next((s for s in SPEEDS if s > self._speed), SPEEDS[-1]) if self._playing else 1.0)

    def slower(self) -> None:
        """J: one speed down, through the slow ones into backwards; from rest, backwards."""
        with self._wake:
            self._play(
                next((s for s in reversed(SPEEDS) if s < self._speed), SPEEDS[0]) if self._playing else -1.0
            )

    def redraw(self) -> None:
        """Draw the present frame again: an option changed."""
        with self._wake:
            self._changed()

    def _play(self, speed: float) -> None:
        frame = self._position().frame
        if self._loop is not None:
            frame = min(max(frame, self._loop[0]), self._loop[1] - 1)
        elif speed > 0 and frame >= self._frames - 1:
            frame = 0
        elif speed < 0 and frame <= 0:
            frame = self._frames - 1
        self._frame, self._started_frame, self._started_at = float(frame), float(frame), self._clock()
        self._speed, self._playing = speed, True
        self._changed()

    def _changed(self) -> None:
        self._dirty = True
        self._wake.notify_all()

    def _position(self) -> Position:
        held = False
        if self._playing:
            elapsed = self._clock() - self._started_at
            held, elapsed = elapsed < 0, max(elapsed, 0.0)
            frame = self._started_frame + elapsed * self._rate * self._speed
            if self._loop is not None:
                start, end = self._loop
                frame = start + (frame - start) % (end - start)
            self._frame = min(max(frame, 0.0), float(self._frames - 1))
            if self._frame != frame:
                self._playing = False
        return Position(int(self._frame + 1e-6), self._playing, self._speed, held)

    def _run(self) -> None:
        shown: Position | None = None
        while True:
            with self._wake:
                while not (self._dirty or self._playing or self._stopped):
                    self._wake.wait()
                if self._stopped:
                    self._pace.report(id(self), False)
                    return
                position, forced = self._position(), self._dirty
                self._dirty = False
            began = self._clock()
            self._pace.report(id(self), position.playing)
            if forced or position != shown:
                with self._pace.first() if forced else self._pace.turn():
                    self._draw(position)
                shown = position
            with self._wake:
                pause = self._pace.interval - (self._clock() - began)
                if pause > 0 and not self._stopped:
                    self._wake.wait_for(lambda: self._stopped, timeout=pause)
