"""What the plots show, as plain arrays: no NaN, few enough points to redraw thirty times a second."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from addb_viewer.app.palette import BLUE, GREY, PLATES, RESIDUAL, SKY, Rgb
from addb_viewer.app.replay import Replay
from solver.summary import Thresholds

MOST_POINTS = 600  # about the width of the panel in pixels, twice


@dataclass(frozen=True)
class Line:
    """One curve; NaN where unknown."""

    label: str
    values: Float[np.ndarray, " frames"]
    color: Rgb
    dashed: bool = False


@dataclass(frozen=True)
class Chart:
    """Curves on one axis, over time."""

    title: str
    unit: str
    lines: tuple[Line, ...]
    shaded: Bool[np.ndarray, " frames"] | None = None  # frames that the figures do not count

    @property
    def heading(self) -> str:
        """Title with unit."""
        return f"{self.title} [{self.unit}]"


def charts_of(replay: Replay) -> tuple[Chart, ...]:
    """The charts that this trial has data for."""
    return (*_marker_chart(replay), *_force_chart(replay), *_residual_charts(replay))


@dataclass(frozen=True)
class Points:
    """A chart's curves, thinned, ready to be sent."""

    times: Float[np.ndarray, " points"]  # [s] ascending
    curves: tuple[Float[np.ndarray, " points"], ...]
    shaded: Float[np.ndarray, " points"]  # 0 or 1

    def with_cursor(self, time: float) -> tuple[Float[np.ndarray, " points+3"], ...]:
        """Times, curves, shading, and last a spike of height 1 at that time."""
        at = int(np.searchsorted(self.times, time))
        times = np.insert(self.times, at, [time] * 3)
        curves = [np.insert(c, at, [np.interp(time, self.times, c)] * 3) for c in (*self.curves, self.shaded)]
        spike = np.zeros(len(times))
        spike[at + 1] = 1.0
        return (times, *curves, spike)


def thinned(chart: Chart, times: Float[np.ndarray, " frames"], most: int = MOST_POINTS) -> Points:
    """Least and greatest value of each stretch of time, so that no peak is lost."""
    shaded = np.zeros(len(times)) if chart.shaded is None else chart.shaded.astype(float)
    curves = tuple(bridged(line.values) for line in chart.lines)
    if len(times) <= most:
        return Points(times.astype(float), curves, shaded)
    edges = np.linspace(0, len(times), most // 2 + 1).astype(int)[:-1]
    return Points(
        times=np.sort(np.concatenate([times[edges], _middles(times, edges)])),
        curves=tuple(_envelope(c, edges) for c in curves),
        shaded=np.repeat(np.maximum.reduceat(shaded, edges), 2),
    )


def bridged(values: Float[np.ndarray, " frames"]) -> Float[np.ndarray, " frames"]:
    """Unknown values by a straight line between their neighbours; all unknown: zero."""
    known = np.isfinite(values)
    if not known.any():
        return np.zeros(len(values))
    rows = np.arange(len(values))
    return np.interp(rows, rows[known], values[known])


def _middles(times: Float[np.ndarray, " frames"], edges: np.ndarray) -> Float[np.ndarray, " edges"]:
    ends = np.append(edges[1:], len(times))
    return 0.5 * (times[edges] + times[ends - 1])


def _envelope(values: Float[np.ndarray, " frames"], edges: np.ndarray) -> Float[np.ndarray, " points"]:
    return np.stack([np.minimum.reduceat(values, edges), np.maximum.reduceat(values, edges)], axis=1).ravel()


def _marker_chart(replay: Replay) -> Iterator[Chart]:
    errors = 100.0 * replay.markers.errors  # [cm]
    known = np.isfinite(errors)
    if not known.any():
        return
    count = known.sum(axis=1)
    squares = np.where(known, errors, 0.0) ** 2
    rms = np.where(count > 0, np.sqrt(squares.sum(axis=1) / np.maximum(count, 1)), np.nan)
    largest = np.where(count > 0, np.where(known, errors, 0.0).max(axis=1), np.nan)
    limits = Thresholds()
    yield Chart(
        "Marker error",
        "cm",
        (
            Line("RMS", rms, BLUE),
            Line("largest", largest, SKY),
            _limit(f"{100 * limits.marker_rms_m:g} cm", 100 * limits.marker_rms_m, replay.frames),
        ),
        shaded=count == 0,
    )


def _force_chart(replay: Replay) -> Iterator[Chart]:
    if not replay.plates:
        return
    measured = np.stack([np.isfinite(plate.force[:, 1]) for plate in replay.plates])
    lines = tuple(
        Line(plate.name, plate.force[:, 1], PLATES[i % len(PLATES)]) for i, plate in enumerate(replay.plates)
    )
    yield Chart("Vertical force", "N", lines, shaded=np.asarray(~measured.any(axis=0)))


def _residual_charts(replay: Replay) -> Iterator[Chart]:
    residual = replay.residual
    if residual is None or not np.isfinite(residual.force).any():
        return
    limits = Thresholds()
    bound = _limit(f"{100 * limits.linear_BW:g} % BW", residual.force_limit, replay.frames)
    yield Chart("Residual force", "N", (_norm(residual.force), bound), shaded=~residual.used)
    bound = _limit(f"{100 * limits.angular_BWh:g} % BW·h", residual.moment_limit, replay.frames)
    yield Chart("Residual moment", "N·m", (_norm(residual.moment), bound), shaded=~residual.used)


def _norm(vectors: Float[np.ndarray, "frames 3"]) -> Line:
    return Line("size", np.linalg.norm(vectors, axis=1), RESIDUAL)


def _limit(label: str, value: float, frames: int) -> Line:
    return Line(label, np.full(frames, value), GREY, dashed=True)
