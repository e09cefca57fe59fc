"""The timeline at the page's lower edge, as data: rows of blocks, and residuals over their bound."""

import math
from collections.abc import Sequence
from typing import Any

from addb_viewer.trial_view.chart_range import value_range
from addb_viewer.trial_view.charts import Chart, Line
from addb_viewer.trial_view.lanes import Block, Lane
from addb_viewer.trial_view.replay import Replay
from annotations.foot_names import foot_words
from solver.common.true_runs import runs

DIGITS = 4  # of a curve's values
ON_STRIP = ("Residual force", "Residual moment")  # charts that the strip has


def trial_json(subject: str, replay: Replay) -> dict[str, Any]:
    """What the page's timeline knows of a trial, once."""
    return {
        "subject": subject,
        "trial": replay.name,
        "frames": replay.frames,
        "rate": replay.rate,
        "first_s": float(replay.times[0]),
        "feet": [[foot, foot_words(foot)] for foot in replay.feet],
    }


def rows_json(lanes: Sequence[Lane]) -> list[dict[str, Any]]:
    """The rows of a trial, from above."""
    return [
        {"label": lane.label, "foot": lane.foot, "blocks": [_block_json(block) for block in lane.blocks]}
        for lane in lanes
    ]


def curves_json(charts: Sequence[Chart]) -> list[dict[str, Any]]:
    """The curves, each over its bound; of values that are not known there is a gap."""
    return [_chart_json(chart) for chart in charts]


def _block_json(block: Block) -> dict[str, Any]:
    return {
        "start": block.start,
        "end": block.end,
        "text": block.text,
        "told": block.told,
        "color": block.color.css,
        "ink": block.color.ink.css,
        "hatched": block.hatched,
        "top": round(1.0 - block.bottom - block.height, 3),
        "height": round(block.height, 3),
        "outlined": block.outlined,
        "hollow": block.hollow,
        "foot": block.foot,
        "flag": block.is_flag,
    }


def _chart_json(chart: Chart) -> dict[str, Any]:
    own = next(line for line in chart.lines if line.is_own)
    bound = next((line for line in chart.lines if line.dashed), None)
    before = next((line for line in chart.lines if line.dotted), None)
    low, high = value_range(chart, slice(None))
    shaded = [] if chart.shaded is None else [[int(a), int(b)] for a, b in runs(chart.shaded)]
    return {
        "title": chart.title,
        "unit": chart.unit,
        "color": own.color.on_any_page,
        "values": _numbers(own),
        "before": None if before is None else _numbers(before),
        "bound": None if bound is None else float(bound.values[0]),
        "bound_label": "" if bound is None else bound.label,
        "low": low,
        "high": high,
        "shaded": shaded,
    }


def _numbers(line: Line) -> list[float | None]:
    values = line.values.tolist()
    return [float(f"{value:.{DIGITS}g}") if math.isfinite(value) else None for value in values]
