"""How far a chart's axis reaches: to what counts. What is larger runs off it, and is marked where it does."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from addb_viewer.text.amounts import TO_95
from addb_viewer.trial_view.charts import Chart, Line
from solver.common.true_runs import runs

AIR = 0.06  # of the range, beyond the outermost value
MOST_BAND = 0.5  # likewise, by which bands stretch an axis
HEADROOM = 0.25  # likewise, where something runs off: room for its mark
USUAL_PER_CENT, RARE = 95.0, 3.0  # a value so many times the one that so many frames stay below is rare
MOST_BOUNDS = 3.0  # times the greatest bound that curves of another fit stretch an axis
NEAR = 0.12  # share of the axis within which two peaks have one mark

Values = Float[np.ndarray, " frames"]


def value_range(chart: Chart, rows: slice) -> tuple[float, float]:
    """Axis limits around zero and all curves with their bands, with a little air.

    Where curves may run off: around zero, the bounds, and what this fit does on frames that count, but for
    rare peaks; another fit's curves stretch that to a few bounds at most.

    Args:
        chart: over all frames of the trial.
        rows: the frames shown.
    """
    known = [line.values[rows][np.isfinite(line.values[rows])] for line in chart.lines]
    values = np.concatenate([np.zeros(1), *known])
    lowest, highest = float(values.min()), float(values.max())
    if chart.runs_off and 0.0 < (1 + AIR) * _reach(chart, rows) < highest:
        return 0.0, (1 + HEADROOM) * _reach(chart, rows)
    most = MOST_BAND * (highest - lowest)
    edges = [
        line.values[rows] + reach * line.std[rows]
        for line in chart.lines
        if line.std is not None
        for reach in (-TO_95, TO_95)
    ]
    kept = np.clip(edges, lowest - most, highest + most)
    lowest, highest = float(np.nanmin(kept, initial=lowest)), float(np.nanmax(kept, initial=highest))
    air = AIR * (highest - lowest) or 1.0
    return (lowest - air if lowest < 0 else 0.0, highest + air)


@dataclass(frozen=True)
class Peak:
    """Where curves run off the axis, and how far."""

    frame: int  # counted from the first one shown
    value: float
    line: Line  # the one that goes farthest


def peaks_beyond(chart: Chart, rows: slice, high: float) -> list[Peak]:
    """The peaks that lie beyond an axis, one for those that lie close together.

    Args:
        chart: over all frames of the trial.
        rows: the frames shown.
        high: upper end of the axis.
    """
    curves = [line for line in chart.lines if not line.dashed]
    if not curves:
        return []
    values = np.stack([np.nan_to_num(line.values[rows], nan=-np.inf) for line in curves])
    farthest = values.max(axis=0)
    peaks: list[int] = []
    for start, end in runs(farthest > high):
        peak = start + int(np.argmax(farthest[start:end]))
        if peaks and peak - peaks[-1] < NEAR * len(farthest):
            peaks[-1] = max(peaks[-1], peak, key=lambda frame: farthest[frame])
        else:
            peaks.append(peak)
    return [Peak(k, float(farthest[k]), curves[int(np.argmax(values[:, k]))]) for k in peaks]


def _reach(chart: Chart, rows: slice) -> float:
    """How far up the axis of a chart goes whose curves may run off."""
    counted = _counted(chart, rows)
    bounds = [float(line.values.max()) for line in chart.lines if line.dashed]
    own = [_usual(line.values[rows][counted]) for line in chart.lines if line.is_own]
    others = [_usual(line.values[rows][counted]) for line in chart.lines if line.dotted]
    reach = max((*bounds, *own), default=0.0)
    if bounds:
        others = [min(other, MOST_BOUNDS * max(bounds)) for other in others]
    return max((reach, *others))


def _counted(chart: Chart, rows: slice) -> Bool[np.ndarray, " frames"]:
    """The frames that count; where none of those shown does, all."""
    if chart.shaded is None or chart.shaded[rows].all():
        return np.ones(len(chart.lines[0].values[rows]), dtype=bool)
    return ~chart.shaded[rows]


def _usual(values: Values) -> float:
    """The largest value, or less where only a rare peak is as large; 0 where none is known."""
    known = values[np.isfinite(values)]
    if not len(known):
        return 0.0
    return float(min(known.max(), RARE * np.percentile(known, USUAL_PER_CENT)))
