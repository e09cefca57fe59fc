"""Whether two marker files show the same motion: one recording, exported twice.

Heights over time are compared, marker by marker, at the one shift of the clocks that suits best: labels,
horizontal axes, units and clocks may differ between two exports, the rise and fall of every marker may not.
"""

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
from jaxtyping import Float

from solver.capture.capture import Markers
from solver.capture.formats.recording_files import MarkersInLab, read_markers
from solver.capture.reading_settings import ForceFileSettings
from solver.common.errors import CaptureError

RATE = 50.0  # [Hz] that heights are compared at
MOVES_M = 0.03  # deviation over time; heights that hardly change are alike in any two recordings
ALIKE = 0.12  # of a marker's own deviation: filters and resampling stay below, two steps of one person do not
OF_MARKERS = 0.8  # that must be alike; some have gaps or were filled
PLACES_M = 0.02  # between heights of a marker that stands still: two exports differ by rounding and filters
PART = 0.9  # of the time; exports of a whole trial differ by frames at its ends
FEWEST = 3  # markers that move
OVERLAP = ForceFileSettings.least_overlap  # of the shorter recording


def markers_of(path: Path, prefix: str | None = None) -> Markers | None:
    """The markers of one person in a file, y up; None where it cannot be read.

    Args:
        path: the file.
        prefix: before the person's labels, in a file of several; None: of whom it has most.
    """
    found = _read(path, _stamp(path), prefix)
    return None if found is None else found.upright


def people_in(path: Path) -> tuple[str, ...]:
    """What stands before the labels of each person in a file, if anything; the first has most of them."""
    found = _read(path, _stamp(path), None)
    return () if found is None or not (found.whose or found.others) else (found.whose, *found.others)


def counterparts_among(tables: Sequence[Path], recordings: Sequence[Path]) -> dict[Path, Path]:
    """Which .trc file shows the same motion as which .c3d file.

    Args:
        tables: .trc files.
        recordings: .c3d files.
    """
    found: dict[Path, Path] = {}
    for recording in recordings:
        for table in tables:
            if table not in found and _same(markers_of(table), markers_of(recording)):
                found[table] = recording
                break
    return found


def is_part_of(table: Path, recording: Path) -> bool:
    """Whether a file shows the person for a part of the time only that the other one of the motion does."""
    one, other = markers_of(table), markers_of(recording)
    return one is not None and other is not None and len(_heights(one)) < PART * len(_heights(other))


def how_they_differ(table: Path, recording: Path) -> str:
    """What tells two files of one name apart; empty where they may be one recording.

    Where nearly nothing moves, heights over time tell little; then the markers must be at the same heights.

    Args:
        table: a .trc file.
        recording: a .c3d file.
    """
    stamps = ((p.stat().st_mtime_ns, p.stat().st_size) for p in (table, recording))
    return _difference(table, recording, tuple(stamps))


@lru_cache(maxsize=4096)
def _difference(table: Path, recording: Path, stamps: tuple[tuple[int, int], ...]) -> str:
    """Compared again when the stamp of a file has changed."""
    one, other = markers_of(table), markers_of(recording)
    if one is None and other is None:
        return ""  # there is but the name
    if one is None or other is None:
        unread = [path.name for path, found in ((table, one), (recording, other)) if found is None]
        return f"{' and '.join(unread)} cannot be read"
    if same_motion(one, other):
        return ""
    a, b = _heights(one), _heights(other)
    moving = [int((heights.std(axis=0) > MOVES_M).sum()) for heights in (a, b)]
    spans = [(markers.frames - 1) / markers.rate for markers in (one, other)]
    said = f"{spans[0]:.2f} s and {spans[1]:.2f} s"
    if max(moving) < FEWEST:
        if a.shape[1] < FEWEST or b.shape[1] < FEWEST:
            return ""
        apart = np.abs(np.median(a, axis=0)[:, None] - np.median(b, axis=0)).min(axis=1)
        if np.mean(apart < PLACES_M) >= OF_MARKERS:
            return ""
        return f"{said}; markers are at other heights, typically {100 * np.median(apart):.0f} cm apart"
    return f"{said}; their markers do not rise and fall alike"


def _same(one: Markers | None, other: Markers | None) -> bool:
    if one is None or other is None:
        return False
    return same_motion(one, other)


def same_motion(one: Markers, other: Markers) -> bool:
    """Whether two recordings, y up, are of one motion."""
    a, b = sorted((_heights(one), _heights(other)), key=lambda heights: heights.shape[1])  # fewer are asked
    shorter = min(len(a), len(b))
    if shorter < RATE * 0.2:
        return False
    least = max(2, int(OVERLAP * shorter))
    return any(
        _alike(a[max(0, -lag) : len(b) - lag], b[max(0, lag) : len(a) + lag])
        for lag in range(least - len(a), len(b) - least + 1)
    )


def _alike(a: Float[np.ndarray, "frames one"], b: Float[np.ndarray, "frames other"]) -> bool:
    """Whether most markers that move have one in the other recording that moves alike."""
    frames = min(len(a), len(b))
    a, b = a[:frames] - a[:frames].mean(axis=0), b[:frames] - b[:frames].mean(axis=0)
    moves = a.std(axis=0) > MOVES_M
    if moves.sum() < FEWEST:
        return False
    a = a[:, moves]
    squares = np.square(a).mean(axis=0)[:, None] + np.square(b).mean(axis=0) - 2 * (a.T @ b) / frames
    nearest = np.sqrt(np.maximum(squares, 0.0).min(axis=1, initial=np.inf))
    return bool(np.mean(nearest < ALIKE * a.std(axis=0)) >= OF_MARKERS)


def _heights(markers: Markers) -> Float[np.ndarray, "frames markers"]:
    """Heights [m] at a common rate while the person is seen, of markers that are there throughout; no gaps.

    Programs export a trial whole, with nobody in it at first, or cut.
    """
    height = markers.positions_ground[:, :, 1]
    seen = np.isfinite(height)
    share = seen.mean(axis=1) if markers.names else np.zeros(markers.frames)
    present = np.flatnonzero((share > 0) & (share >= 0.5 * share.max(initial=0.0)))
    if len(present) < 2:
        return np.zeros((0, 0))
    height, seen = (table[present[0] : present[-1] + 1] for table in (height, seen))
    often = np.flatnonzero(seen.mean(axis=0) > 0.9)
    own = np.arange(len(height)) / markers.rate
    times = np.arange(0.0, own[-1], 1 / RATE)
    columns = [np.interp(times, own[seen[:, k]], height[seen[:, k], k]) for k in often]
    return np.stack(columns, axis=1) if columns else np.zeros((len(times), 0))


def _stamp(path: Path) -> tuple[int, int]:
    status = path.stat()
    return status.st_mtime_ns, status.st_size


@lru_cache(maxsize=16)
def _read(path: Path, stamp: tuple[int, int], prefix: str | None) -> MarkersInLab | None:
    """Read again when the file's stamp, its time and size, has changed."""
    try:
        return read_markers(path, prefix=prefix)
    except CaptureError:
        return None
