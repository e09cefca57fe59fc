"""Chosen quantities over time, as the page draws them."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from addb_viewer.text.amounts import TO_95
from addb_viewer.trial_view.chart_html import short_labels
from addb_viewer.trial_view.chart_range import peaks_beyond, value_range
from addb_viewer.trial_view.charts import BEFORE, Chart, Line, charts_of
from addb_viewer.trial_view.joint_quantities import ALSO, JointQuantity, Kind, quantities_of
from addb_viewer.trial_view.palette import BLUE, GREEN, PURPLE, Rgb
from addb_viewer.trial_view.replay import Replay
from addb_viewer.trial_view.strip import ON_STRIP
from addb_viewer.trial_view.trial_curves import TrialCurves
from solver.common.true_runs import runs

SIDE_COLORS = {"right": GREEN, "left": PURPLE, "": BLUE}  # as forces on the feet have them
DIGITS = {"°": 2, "°/s": 1, "N·m": 2, "N": 1, "W": 1, "cm": 3, "m": 4, "m/s": 4}  # after the point
BAND = "95 % band of the markers' errors"
NO_BAND = "; none where a force was predicted, not measured"
AT_FIRST = ("marker error", "vertical force", "knee_angle angle", "knee_angle torque")


def choices_json(replay: Replay, *, per_kg: bool = False) -> list[dict[str, str]]:
    """What can be chosen of a trial: its words, unit, and other words by which people look for it."""
    found = [
        {"id": chart.title.lower(), "words": chart.title, "unit": chart.unit, "also": ""}
        for chart in _other_charts(replay, None)
    ]
    for quantity in () if replay.joints is None else quantities_of(replay.joints, per_kg=per_kg):
        told = {"id": quantity.id, "words": quantity.words, "unit": quantity.unit}
        found.append(told | {"also": ALSO[quantity.kind]})
    return found


def charts_json(
    replay: Replay,
    before: Replay | None,
    others: Sequence[TrialCurves],
    chosen: Sequence[str],
    *,
    per_kg: bool = False,
    ready: Mapping[str, dict[str, Any]] | None = None,
) -> list[dict[str, Any]]:
    """The chosen charts that this trial has data for, in the order of choice.

    Args:
        replay: the trial.
        before: the same trial as the solve that is compared with has it.
        others: trials that are drawn over it; all begin together.
        chosen: ids from `choices_json`.
        per_kg: torques and powers for each kilogram of the person.
        ready: charts of other things, by id.
    """
    plain = {chart.title.lower(): chart for chart in _other_charts(replay, before)}
    own = () if replay.joints is None else quantities_of(replay.joints, per_kg=per_kg)
    joints = {quantity.id: quantity for quantity in own}
    drawn = []
    for name in dict.fromkeys(chosen):
        if name in plain:
            drawn.append(_chart_json(name, plain[name], ()))
        elif name in joints:
            chart = _joint_chart(joints[name], replay, before)
            drawn.append(_chart_json(name, chart, _overlaid(joints[name], others, replay.rate)))
            drawn[-1]["band"] = _band_words(joints[name].kind, chart)
        elif ready and name in ready:
            drawn.append(ready[name])
    return drawn


def _other_charts(replay: Replay, before: Replay | None) -> list[Chart]:
    return [chart for chart in charts_of(replay, before) if chart.title not in ON_STRIP]


def _joint_chart(quantity: JointQuantity, replay: Replay, before: Replay | None) -> Chart:
    assert replay.joints is not None
    lines = []
    was = None if before is None or before.joints is None else quantity.of(before.joints)
    if before is not None and before.joints is not None and was is not None:
        lines = [
            Line(BEFORE, was.values(before.joints, column), SIDE_COLORS[side], dotted=True)
            for side, column in was.columns
        ]
    for side, column in quantity.columns:
        values, std = quantity.values(replay.joints, column), quantity.std(replay.joints, column)
        lines.append(Line(side, values, SIDE_COLORS[side], std=std))
    shaded = None
    if quantity.kind.rests_on_forces and replay.residual is not None:
        shaded = ~replay.residual.used
    return Chart(quantity.words, quantity.unit, tuple(lines), shaded)


def _band_words(kind: Kind, chart: Chart) -> str:
    """What a chart's bands are; empty where it has none."""
    if all(line.std is None for line in chart.lines):
        return ""
    about = ", about the trial's mean" if kind is Kind.POSITION else ""
    return BAND + (NO_BAND if kind.rests_on_forces else about)


def _overlaid(quantity: JointQuantity, others: Sequence[TrialCurves], rate: float) -> list[dict[str, Any]]:
    """The same quantity of other trials; `step` says how many frames of this trial one of theirs lasts."""
    drawn = []
    for other in others:
        same = quantity.of(other.joints)
        if same is None:
            continue
        for side, column in same.columns:
            values = same.values(other.joints, column)
            line = _line_json(side, SIDE_COLORS[side], values, quantity.unit)
            drawn.append(line | {"style": "trial", "trial": other.name, "step": rate / other.rate})
    return drawn


def _chart_json(name: str, chart: Chart, overlaid: Sequence[dict[str, Any]]) -> dict[str, Any]:
    low, high = value_range(chart, slice(None))
    others = [value for line in overlaid for value in line["values"] if value is not None]
    if others:
        low, high = min(low, *others), max(high, *others)
    peaks = peaks_beyond(chart, slice(None), high) if chart.runs_off else []
    shorter = short_labels([line.label for line in chart.lines])
    return {
        "id": name,
        "title": chart.title,
        "unit": chart.unit,
        "low": low,
        "high": high,
        "shaded": [] if chart.shaded is None else [[int(a), int(b)] for a, b in runs(chart.shaded)],
        "peaks": [[peak.frame, peak.value, peak.line.color.as_text] for peak in peaks],
        "lines": [
            *overlaid,
            *(
                _line_json(line.label, line.color, line.values, chart.unit)
                | {"style": _style(line), "short": short, "band": _band(line, chart.unit)}
                for line, short in zip(chart.lines, shorter, strict=True)
            ),
        ],
    }


def _band(line: Line, unit: str) -> list[Any] | None:
    return None if line.std is None else plain_numbers(TO_95 * line.std, unit)


def _style(line: Line) -> str:
    return "bound" if line.dashed else "before" if line.dotted else ""


def _line_json(label: str, color: Rgb, values: Float[np.ndarray, " frames"], unit: str) -> dict[str, Any]:
    return {
        "label": label,
        "color": color.on_any_page,
        "ink": color.as_text,
        "values": plain_numbers(values, unit),
        "step": 1.0,
        "first": 0.0,
        "trial": "",
    }


def plain_numbers(values: Float[np.ndarray, " *rows"], unit: str) -> list[Any]:
    """As JSON holds them: rounded to what can be seen, None for what is not known."""
    rounded = np.round(values, DIGITS.get(unit, 3)).astype(object)
    rounded[~np.isfinite(values)] = None
    plain: list[Any] = rounded.tolist()
    return plain
