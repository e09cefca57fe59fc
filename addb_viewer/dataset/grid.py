"""The frames of a release: equally spaced times from a trial's first frame on, and where a trial is cut."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.interpolate import CubicSpline

from solver.common.true_runs import runs

RELEASE_RATE_HZ = 100.0  # the dataset paper's
_SNAP = 1e-6  # [native frames] within which a time is that of a native frame: rounding
_SAME_CLOCK = 0.01  # [native frames] that rates may differ by over a whole trial: printed times are rounded


@dataclass(frozen=True)
class Grid:
    """Times t_k = t_0 + k / rate within a trial, t_0 its first frame."""

    rate: float  # [Hz]
    frames: int
    start_time: float  # [s] t_0 on the recording's clock
    native_rate: float  # [Hz] of the recording
    native_frames: int

    @property
    def is_native(self) -> bool:
        """Whether the frames are the recording's own: then everything passes as it is."""
        return self.rate == self.native_rate

    @cached_property
    def seconds(self) -> Float[np.ndarray, " frames"]:
        """Since the first frame [s]."""
        return np.arange(self.frames) / self.rate

    @property
    def times(self) -> Float[np.ndarray, " frames"]:
        """On the recording's clock [s]."""
        return self.start_time + self.seconds

    @cached_property
    def places(self) -> Float[np.ndarray, " frames"]:
        """Where each frame lies, in native frames."""
        places = self.seconds * self.native_rate
        nearest = np.round(places)
        return np.clip(np.where(np.abs(places - nearest) < _SNAP, nearest, places), 0, self.native_frames - 1)

    @cached_property
    def before(self) -> Int[np.ndarray, " frames"]:
        """The native frame at or before each."""
        return np.floor(self.places).astype(int)

    @cached_property
    def after(self) -> Int[np.ndarray, " frames"]:
        """The native frame at or after each; the same one where they coincide."""
        return np.ceil(self.places).astype(int)

    @cached_property
    def nearest(self) -> Int[np.ndarray, " frames"]:
        """The nearest native frame; of two the later one."""
        return np.floor(self.places + 0.5).astype(int)

    def at_nearest(self, native: np.ndarray) -> np.ndarray:
        """Values of the nearest native frames."""
        return native if self.is_native else native[self.nearest]

    def at_both(self, native: Bool[np.ndarray, "native *n"]) -> Bool[np.ndarray, "frames *n"]:
        """True where both neighbouring native frames are."""
        return native if self.is_native else native[self.before] & native[self.after]

    def at_either(self, native: Bool[np.ndarray, "native *n"]) -> Bool[np.ndarray, "frames *n"]:
        """True where one of the neighbouring native frames is."""
        return native if self.is_native else native[self.before] | native[self.after]

    def interpolated(self, native: Float[np.ndarray, "native *n"]) -> Float[np.ndarray, "frames *n"]:
        """Values of the cubic splines through runs of native frames without NaN; NaN beyond these."""
        if self.is_native:
            return native
        together = self._splined(native.reshape(self.native_frames, 1, -1))
        return together.reshape(self.frames, *native.shape[1:])

    def interpolated_where_seen(
        self, native: Float[np.ndarray, "native *n 3"]
    ) -> Float[np.ndarray, "frames *n 3"]:
        """Likewise of each vector by itself: NaN unless both neighbouring frames are seen."""
        if self.is_native:
            return native
        apart = self._splined(native.reshape(self.native_frames, -1, 3))
        return apart.reshape(self.frames, *native.shape[1:])

    def _splined(self, native: Float[np.ndarray, "native parts n"]) -> Float[np.ndarray, "frames parts n"]:
        """Each part by the splines through its own runs."""
        result = np.full((self.frames, *native.shape[1:]), np.nan)
        seen = np.isfinite(native).all(axis=2)
        for part in range(native.shape[1]):
            for start, end in runs(seen[:, part]):
                inside = slice(
                    *np.searchsorted(self.places, (start, np.nextafter(end - 1, end)), side="left")
                )
                if end - start == 1:
                    result[inside, part] = native[start, part]
                else:
                    curve = CubicSpline(np.arange(start, end), native[start:end, part])
                    result[inside, part] = curve(self.places[inside])
        return result

    def frames_nearest_to(self, start: int, end: int) -> tuple[int, int]:
        """The range of frames whose nearest native frames are start to end − 1.

        Args:
            start: first native frame.
            end: the first after the range.
        """
        if self.is_native:
            return start, end
        first, last = np.searchsorted(self.nearest, (start, end), side="left")
        return int(first), int(last)


def grid_of(native_frames: int, native_rate: float, start_time: float, rate: float | None) -> Grid:
    """The release's frames within a trial.

    Args:
        native_frames: of the recording.
        native_rate: likewise [Hz].
        start_time: of its first frame [s].
        rate: of the release [Hz]; None: the recording's own.
    """
    if rate is None or abs(native_rate / rate - 1) * native_frames < _SAME_CLOCK:
        rate = native_rate
    end = (native_frames - 1) / native_rate
    frames = native_frames if rate == native_rate else int(np.floor(rate * end + _SNAP)) + 1
    return Grid(rate, frames, start_time, native_rate, native_frames)


LONGEST = 2000  # frames; the dataset paper's
SHORTEST = 12  # frames; fewer are left out, 12 are kept


@dataclass(frozen=True)
class Segment:
    """Frames start to end − 1 of a trial, on the release's grid."""

    start: int
    end: int

    @property
    def frames(self) -> int:
        """How many."""
        return self.end - self.start

    @property
    def rows(self) -> slice:
        """Of arrays with a row a frame."""
        return slice(self.start, self.end)


@dataclass(frozen=True)
class Cuts:
    """What becomes of a trial's frames."""

    kept: tuple[Segment, ...]
    erroneous: tuple[Segment, ...]
    too_short: tuple[Segment, ...]

    def number(self, frames: int) -> Int[np.ndarray, " frames"]:
        """Of the segment that each frame is in, from 0; −1 for frames in none.

        Args:
            frames: of the trial.
        """
        number = np.full(frames, -1)
        for k, segment in enumerate(self.kept):
            number[segment.rows] = k
        return number


def cuts_of(erroneous: Bool[np.ndarray, " frames"]) -> Cuts:
    """Spans between erroneous stretches, each in as few pieces as may be, as even as may be.

    Args:
        erroneous: frames that must not be used.
    """
    pieces = [piece for start, end in runs(~erroneous) for piece in evenly_cut(start, end)]
    return Cuts(
        tuple(piece for piece in pieces if piece.frames >= SHORTEST),
        tuple(Segment(start, end) for start, end in runs(erroneous)),
        tuple(piece for piece in pieces if piece.frames < SHORTEST),
    )


def evenly_cut(start: int, end: int) -> tuple[Segment, ...]:
    """ceil(n / 2000) pieces of floor or ceil frames, the longer ones first.

    Args:
        start: first frame of the span.
        end: the first after it.
    """
    frames = end - start
    pieces = -(-frames // LONGEST)
    sizes = [frames // pieces + (k < frames % pieces) for k in range(pieces)]
    borders = np.cumsum([start, *sizes]).tolist()
    return tuple(Segment(a, b) for a, b in pairwise(borders))
