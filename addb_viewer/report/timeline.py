"""Residuals, marker errors and forces of a trial over time, above the lanes that say which frames count."""

import html
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from addb_viewer.report.frames_kept import frames_words
from addb_viewer.report.markup import Safe, element, joined
from addb_viewer.trial_view.chart_html import GUTTER, MARGIN, axis_html, chart_html
from addb_viewer.trial_view.charts import BEFORE, Chart, Line, charts_of
from addb_viewer.trial_view.lanes import Block, Lane
from addb_viewer.trial_view.recorded_subject import TrialRecord
from addb_viewer.trial_view.residual_charts import residual_charts
from addb_viewer.trial_view.span import Span
from addb_viewer.trial_view.trial_events import lanes_of
from solver.diagnosis.diagnosis_report import DiagnosisReport
from solver.dynamics.thresholds import Thresholds

HEIGHT = 96  # [pixel] of a chart
ORDER = ("Residual force", "Residual moment", "Marker error", "Vertical force")
SHORT = (  # words of lanes, so that they fit beside them
    ("force missing", "missing"),
    ("forces used", "usable"),
    ("proposed by detection", "proposed"),
    ("no plate carries it", "no plate"),
    (" right", " R"),
    (" left", " L"),
)
LETTERS = 105  # that fit on a lane
MARKER_ERROR = "Marker error"
ON_UNUSED = ("Residual force", "Residual moment")  # where no bound applies


LANE = 16  # [pixel] with the line between two


def timeline(record: TrialRecord, index: int, diagnosis: DiagnosisReport | None) -> Safe:
    """Charts and lanes of a trial on one time axis; a click leads the player there.

    Args:
        record: the trial.
        index: of it in the report.
        diagnosis: of the recording; None where nobody asked.
    """
    found = {chart.title: chart for chart in charts_of(record.replay, record.before)}
    charts = [_told(found[title], record) for title in ORDER if title in found]
    lanes = [_short(lane, _span(record)) for lane in lanes_of(record, diagnosis)]
    return _area(record, index, charts, lanes)


def diagnosed_timeline(record: TrialRecord, index: int, diagnosis: DiagnosisReport) -> Safe | None:
    """The residual without and with the named causes; None where the trial was not diagnosed."""
    charts = residual_charts(diagnosis, record.replay)
    return _area(record, index, charts, ()) if charts else None


def _area(record: TrialRecord, index: int, charts: Sequence[Chart], lanes: Sequence[Lane]) -> Safe:
    replay = record.replay
    span = _span(record)
    drawn = "".join(chart_html(chart, span, HEIGHT) for chart in charts)
    content = Safe(drawn + lanes_html(tuple(lanes), span) + axis_html(span, replay.times))
    over = Safe('<div class="area"></div><div class="cursor" hidden></div>')
    label = f"{replay.name}: {', '.join(chart.title.lower() for chart in charts)} over time"
    return element(
        "div", joined((content, over)), class_="timeline", data_trial=str(index), role="img", aria_label=label
    )


def _span(record: TrialRecord) -> Span:
    return Span(0, max(record.replay.frames - 1, 1))


def _told(chart: Chart, record: TrialRecord) -> Chart:
    """With words for readers who see two fits for the first time, and residuals only where they count.

    Elsewhere a residual is the missing force itself, and would dwarf all else.
    """
    words = {BEFORE: record.before_name, "size": "this fit"}
    lines = [
        replace(line, label=_bound(chart, line) if line.dashed else words.get(line.label, line.label))
        for line in chart.lines
    ]
    residual = record.replay.residual
    if chart.title in ON_UNUSED and residual is not None:
        lines = [
            line if line.dashed else replace(line, values=np.where(residual.used, line.values, np.nan))
            for line in lines
        ]
    if chart.title == MARKER_ERROR:
        bound = 100 * Thresholds().marker_max_m
        lines.append(
            replace(lines[-1], label=f"{bound:g} cm for the largest", values=lines[-1].values * 0 + bound)
        )
    return replace(chart, lines=tuple(lines))


def _bound(chart: Chart, line: Line) -> str:
    """A bound as the report's tables name it."""
    limits = Thresholds()
    named = dict(zip(ON_UNUSED, (f"{limits.linear_BW:g} BW", f"{limits.angular_BWh:g} BW·h"), strict=True))
    return f"bound {named.get(chart.title, line.label)}"


def _short(lane: Lane, span: Span) -> Lane:
    blocks = tuple(
        replace(
            block,
            text=_fitting(_shortened(block.text), block, span),
            told=f"{block.told}, frames {frames_words(block.start, block.end)}",
        )
        for block in lane.blocks
    )
    return Lane(_shortened(lane.label), blocks)


def _fitting(words: str, block: Block, span: Span) -> str:
    """Words that have room on their block; else none, and pointing at it says them."""
    place = span.block(block.start, block.end)
    return words if place is not None and len(words) < LETTERS * place[1] else ""


def _shortened(words: str) -> str:
    for long, short in SHORT:
        words = words.replace(long, short)
    return words


def lanes_html(lanes: tuple[Lane, ...], span: Span) -> str:
    """All lanes; `LANE` pixels each."""
    return "".join(_lane_html(lane, span) for lane in lanes)


def _lane_html(lane: Lane, span: Span) -> str:
    blocks = "".join(_block_html(block, span) for block in lane.blocks)
    return (
        f"<div style='position:relative;height:{LANE}px'>"
        f"<div style='position:absolute;left:8px;top:1px;opacity:.8'>{html.escape(lane.label)}</div>"
        f"<div style='position:absolute;left:{GUTTER}px;right:{MARGIN}px;top:0;bottom:1px;overflow:hidden;"
        f"background:rgba(128,128,128,.12)'>{blocks}</div></div>"
    )


def _block_html(block: Block, span: Span) -> str:
    place = span.block(block.start, block.end)
    if place is None:
        return ""
    left, width = place
    told = f"{block.start}–{block.end - 1}: {block.told}"
    return (
        f"<div title='{html.escape(told)}' style='position:absolute;"
        f"left:{100 * left:.3f}%;width:{100 * width:.3f}%;min-width:2px;bottom:0;"
        f"height:{100 * block.height:.0f}%;"
        f"box-sizing:border-box;overflow:hidden;white-space:nowrap;text-align:center;font-weight:600;"
        f"{_surface(block)}'>{html.escape(block.text)}</div>"
    )


def _surface(block: Block) -> str:
    outline = "outline:2px solid currentColor;outline-offset:-2px;" if block.outlined else ""
    border = f"border:1px solid {block.color.css};"
    if block.hollow:
        return f"{outline}border:1.5px dashed currentColor"
    if not block.hatched:
        return f"{outline}{border}background:{block.color.css};color:{block.color.ink.css}"
    strong, weak = block.color.faded(0.55), block.color.faded(0.15)
    stripes = f"repeating-linear-gradient(135deg,{strong} 0 3px,{weak} 3px 7px)"
    return f"{outline}{border}background:{stripes}"
