"""Whether two marker files show the same motion: one recording, exported twice.

Heights over time are compared, marker by marker, at the one shift of the clocks that suits best: labels,
horizontal axes, units and clocks may differ between two exports, the rise and fall of every marker may not.
"""

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
from jaxtyping import Float

from solver.capture.axes import markers_y_up, vertical_axis
from solver.capture.c3d import read_c3d_markers
from solver.capture.capture import Markers
from solver.capture.trc import read_trc
from solver.errors import CaptureError

RATE = 50.0  # [Hz] that heights are compared at
MOVES_M = 0.03  # deviation over time; heights that hardly change are alike in any two recordings
ALIKE = 0.12  # of a marker's own deviation: filters and resampling stay below, two steps of one person do not
OF_MARKERS = 0.8  # that must be alike; some have gaps or were filled
FEWEST = 3  # markers that move
OVERLAP = 0.5  # of the shorter recording


def markers_of(path: Path) -> Markers | None:
    """The markers of a file, y up; None where it cannot be read."""
    status = path.stat()
    return _markers(path, (status.st_mtime_ns, status.st_size))


def twins_among(tables: Sequence[Path], recordings: Sequence[Path]) -> dict[Path, Path]:
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


def _same(one: Markers | None, other: Markers | None) -> bool:
    if one is None or other is None:
        return False
    return same_motion(one, other)


def same_motion(one: Markers, other: Markers) -> bool:
    """Whether two recordings, y up, are of one motion."""
    a, b = _heights(one), _heights(other)
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
    """Heights [m] at a common rate, of markers that were seen on most frames; gaps are bridged."""
    height = markers.positions_ground[:, :, 1]
    seen = np.isfinite(height)
    often = np.flatnonzero(seen.mean(axis=0) > 0.9)
    times = np.arange(0.0, (markers.frames - 1) / markers.rate, 1 / RATE)
    own = np.arange(markers.frames) / markers.rate
    columns = [np.interp(times, own[seen[:, k]], height[seen[:, k], k]) for k in often]
    return np.stack(columns, axis=1) if columns else np.zeros((len(times), 0))


@lru_cache(maxsize=16)
def _markers(path: Path, stamp: tuple[int, int]) -> Markers | None:
    """Read again when the file's stamp, its time and size, has changed."""
    try:
        if path.suffix.lower() == ".c3d":
            c3d = read_c3d_markers(path)
            return markers_y_up(c3d.markers, c3d.up)
        markers = read_trc(path).markers
        return markers_y_up(markers, vertical_axis(markers, default="y"))
    except CaptureError:
        return None
