"""Charts as pieces of the page: vector drawings of our own; nothing is redrawn while the cursor moves."""

import html
from collections.abc import Sequence
from itertools import takewhile

import numpy as np
from jaxtyping import Bool, Float

from addb_viewer.trial_view.chart_range import Peak, peaks_beyond, value_range
from addb_viewer.trial_view.charts import Chart, Line
from addb_viewer.trial_view.span import Span
from solver.common.true_runs import runs

GUTTER, MARGIN = 66, 10  # [pixel] left and right of everything with a time axis
HEADING = 17  # [pixel]
SAMPLE = 18  # [pixel] of a curve in its legend
AXIS = 32  # [pixel] of the time axis below all charts
MANY = 3  # names whose common beginning is left out
MOST_POINTS = 900  # of a curve: more than pixels
WIDTH, HEIGHT = 1000.0, 100.0  # of the drawing's own coordinates
FAINT, SMALL = 0.13, ".75rem"
BEYOND = "▲"  # where a curve runs off the axis
PAPER = "var(--mantine-color-body, var(--paper))"  # of the app's page, of a report
EDGE = 0.06  # share of the axis in which signs lean inwards


def chart_html(chart: Chart, span: Span, height: int) -> str:
    """Heading, axis and curves.

    Args:
        chart: over all frames of the trial.
        span: the frames shown.
        height: of the plot without its heading [pixel].
    """
    rows = slice(span.first, span.last + 1)
    low, high = value_range(chart, rows)

    def up(value: float) -> float:
        return HEIGHT * (1.0 - (value - low) / (high - low))

    ticks = [tick for tick in nice_ticks(low, high, 3) if 6.0 <= up(tick) <= 98.0]
    grid = "".join(f"<path d='M0 {up(t):.1f}H{WIDTH:g}' class='g'/>" for t in ticks)
    curves = "".join(_stroke(line, curve_path(line.values[rows], low, high)) for line in chart.lines)
    labels = "".join(
        f"<div style='position:absolute;right:calc(100% + 4px);top:{up(t):.1f}%;transform:translateY(-50%);"
        f"opacity:.75;white-space:nowrap'>{number(t, high - low)}</div>"
        for t in ticks
    )
    return (
        f"<div style='height:{HEADING}px;overflow:hidden;white-space:nowrap;padding:2px {MARGIN}px 0 8px'>"
        f"{_legend(chart)}</div>"
        f"<div style='position:relative;height:{height}px;margin:0 {MARGIN}px 0 {GUTTER}px'>"
        f"<svg viewBox='0 0 {WIDTH:g} {HEIGHT:g}' preserveAspectRatio='none' style='position:absolute;"
        "inset:0;width:100%;height:100%;border-left:1px solid;border-bottom:1px solid;border-color:inherit'>"
        f"<g style='stroke:none'>{_shading(chart.shaded, span)}</g>"
        f"<g fill='none' style='stroke:currentColor;stroke-opacity:{FAINT}'>{grid}</g>"
        f"<g fill='none' vector-effect='non-scaling-stroke'>{curves}</g></svg>"
        f"{_marks(chart, rows, high)}{labels}</div>"
    )


def axis_html(span: Span, times: Float[np.ndarray, " frames"]) -> str:
    """The common time axis [s]."""
    start, end = float(times[span.first]), float(times[min(span.last, len(times) - 1)])
    ticks = "".join(
        f"<div style='position:absolute;left:{100 * (t - start) / (end - start or 1):.2f}%;top:0;"
        f"transform:translateX(-50%);border-left:0'>{number(t, end - start)}</div>"
        for t in nice_ticks(start, end, 6)
    )
    return (
        f"<div style='position:relative;height:{AXIS}px;margin:0 {MARGIN}px 0 {GUTTER}px;opacity:.8'>{ticks}"
        "<div style='position:absolute;top:0;right:calc(100% + 12px);white-space:nowrap'>time [s]</div></div>"
    )


def nice_ticks(low: float, high: float, about: int) -> list[float]:
    """Round numbers between two limits, about so many."""
    if not high > low:
        return [low]
    raw = (high - low) / about
    power = 10.0 ** np.floor(np.log10(raw))
    step = float(power * next(f for f in (1.0, 2.0, 5.0, 10.0) if f * power >= raw * 0.999))
    first = int(np.ceil(low / step - 1e-9))
    return [k * step for k in range(first, int(np.floor(high / step + 1e-9)) + 1)]


def number(value: float, of: float) -> str:
    """As many digits as the range needs."""
    digits = max(0, int(np.ceil(1.0 - np.log10(of)))) if of > 0 else 2
    text = f"{value:.{digits}f}"
    return text.rstrip("0").rstrip(".").replace("-", "−") if "." in text else text.replace("-", "−")


def curve_path(values: Float[np.ndarray, " frames"], low: float, high: float, most: int = MOST_POINTS) -> str:
    """A curve in the drawing's coordinates; gaps stay gaps, and thinning keeps every peak."""
    at = np.arange(len(values), dtype=float)
    if len(values) > most:
        at, values = _envelope(values, most)
    x = WIDTH * at / max(at[-1], 1.0) if len(at) else at
    y = HEIGHT * (1.0 - (values - low) / (high - low))
    parts = []
    for start, end in runs(np.isfinite(y)):
        points = " ".join(f"{a:.1f} {b:.1f}" for a, b in zip(x[start:end], y[start:end], strict=True))
        parts.append(f"M{points}" if end - start > 1 else f"M{points}h0.5")
    return "".join(parts)


def _envelope(
    values: Float[np.ndarray, " frames"], most: int
) -> tuple[Float[np.ndarray, " points"], Float[np.ndarray, " points"]]:
    """Least and greatest value of each stretch of time; unknown where nothing in it is known."""
    edges = np.linspace(0, len(values), most // 2 + 1).astype(int)[:-1]
    ends = np.append(edges[1:], len(values))
    known = np.isfinite(values)
    some = np.add.reduceat(known.astype(int), edges) > 0
    least = np.where(some, np.minimum.reduceat(np.where(known, values, np.inf), edges), np.nan)
    most_of = np.where(some, np.maximum.reduceat(np.where(known, values, -np.inf), edges), np.nan)
    at = np.stack([edges, ends - 1], axis=1).astype(float).ravel()
    return at, np.stack([least, most_of], axis=1).ravel()


def _stroke(line: Line, path: str) -> str:
    width = 1.0 if line.dashed else 1.6
    dashes = "5 4" if line.dashed else "2 2" if line.dotted else "none"
    dash = f" stroke-dasharray='{dashes}' stroke-width='{width}'"
    return (
        f"<path d='{path}' style='stroke:{line.color.on_any_page}'{dash} vector-effect='non-scaling-stroke'/>"
    )


def _marks(chart: Chart, rows: slice, high: float) -> str:
    """Wherever curves run off the axis, a sign at the top, and how far they go."""
    last = max(len(chart.lines[0].values[rows]) - 1, 1)
    return "".join(_mark(peak, peak.frame / last) for peak in peaks_beyond(chart, rows, high))


def _mark(peak: Peak, share: float) -> str:
    shift = 0 if share < EDGE else -100 if share > 1 - EDGE else -50
    return (
        f"<div style='position:absolute;left:{100 * share:.2f}%;top:1px;transform:translateX({shift}%);"
        f"line-height:1;white-space:nowrap;padding:0 2px;background:{PAPER};color:{peak.line.color.as_text}'>"
        f"{BEYOND} {number(peak.value, peak.value)}</div>"
    )


def _shading(shaded: Bool[np.ndarray, " frames"] | None, span: Span) -> str:
    if shaded is None:
        return ""
    blocks = (span.block(int(start), int(end)) for start, end in runs(shaded))
    return "".join(
        f"<rect x='{WIDTH * b[0]:.1f}' y='0' width='{WIDTH * b[1]:.1f}' height='{HEIGHT:g}' "
        "fill='gray' fill-opacity='.22'/>"
        for b in blocks
        if b
    )


def _legend(chart: Chart) -> str:
    keys = "".join(
        f"<span style='margin-left:.7em'><svg width='{SAMPLE}' height='8' fill='none'>"
        f"{_stroke(line, f'M0 5H{SAMPLE}')}</svg> {html.escape(label)}</span>"
        for line, label in zip(chart.lines, short_labels([line.label for line in chart.lines]), strict=True)
        if label
    )
    return f"<b>{html.escape(chart.heading)}</b>{keys}"


def short_labels(labels: Sequence[str]) -> list[str]:
    """Many names that begin alike without their common beginning, so that they fit on a line."""
    alike = takewhile(lambda letters: len(set(letters)) == 1, zip(*labels, strict=False))
    common = [letters[0] for letters in alike]
    cut = max((i + 1 for i, letter in enumerate(common) if not letter.isalnum()), default=0)
    if len(labels) <= MANY or any(len(label) == cut for label in labels):
        return list(labels)
    return [label[cut:] for label in labels]
