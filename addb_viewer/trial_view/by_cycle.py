"""Chosen quantities over the gait cycle, as the page draws them: each foot's strides and their mean."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from addb_viewer.text.amounts import counted
from addb_viewer.trial_view.chart_range import AIR
from addb_viewer.trial_view.joint_quantities import JointQuantity, quantities_of
from addb_viewer.trial_view.over_time import SIDE_COLORS, plain_numbers
from addb_viewer.trial_view.trial_curves import TrialCurves
from annotations.foot_names import foot_words
from solver.gait.cycles import Cycle
from solver.gait.stride_curves import StrideCurves, stride_curves
from solver.gait.trial_gait import Gait

SIDES = ("right", "left")


@dataclass(frozen=True)
class CycledTrial:
    """A trial and its strides."""

    of: TrialCurves
    gait: Gait | None  # None: no stances
    per_kg: bool = False  # torques and powers for each kilogram of the person

    def cycles(self, side: str) -> tuple[Cycle, ...]:
        """The strides of a foot.

        Args:
            side: right or left.
        """
        if self.gait is None:
            return ()
        return tuple(one for one in self.gait.cycles if foot_words(self.gait.feet[one.foot]) == side)

    def curves(self, quantity: JointQuantity) -> Iterator[tuple[str, StrideCurves]]:
        """A quantity of each side over that foot's strides; of the trunk over those of either foot."""
        for side, column in quantity.columns:
            values, std = quantity.values(self.of.joints, column), quantity.std(self.of.joints, column)
            rests = quantity.kind.rests_on_forces and not self.of.joints.predicted
            counts = self.of.counts if rests else None
            for foot in (side,) if side else SIDES:
                yield foot, stride_curves(self.cycles(foot), self.of.times, values, counts, std)

    def quantities(self) -> dict[str, JointQuantity]:
        """By id."""
        return {quantity.id: quantity for quantity in quantities_of(self.of.joints, per_kg=self.per_kg)}


def cycle_charts(
    trial: CycledTrial,
    others: Sequence[CycledTrial],
    chosen: Sequence[str],
    before: CycledTrial | None = None,
) -> dict[str, Any]:
    """The chosen charts, in the order of choice, and what to say where something is not there.

    Args:
        trial: on the screen.
        others: whose means are drawn over it.
        chosen: ids of quantities.
        before: the trial as the solve that is compared with has it.
    """
    joints = trial.quantities()
    behind = [("trial", other) for other in others] + ([("before", before)] if before else [])
    drawn = [_chart_json(joints[name], trial, behind) for name in dict.fromkeys(chosen) if name in joints]
    return {
        "charts": [chart for chart in drawn if chart["lines"]],
        "note": _note(trial, drawn, sum(name not in joints for name in chosen)),
        "strides": {side: [[c.start_s, c.end_s] for c in trial.cycles(side)] for side in SIDES},
    }


def _chart_json(
    quantity: JointQuantity, trial: CycledTrial, behind: Sequence[tuple[str, CycledTrial]]
) -> dict[str, Any]:
    own = list(trial.curves(quantity))
    lines = [_line_json(side, curves, quantity.unit) for side, curves in own if len(curves.cycles)]
    for style, other in behind:
        same = quantity.of(other.of.joints)
        for side, curves in () if same is None else other.curves(same):
            if len(curves.cycles):
                line = _line_json(side, curves, quantity.unit, single=False)
                lines.append(line | {"style": style, "trial": other.of.name if style == "trial" else ""})
    low, high = axis_limits(part for line in lines for part in _reach(line))
    return {
        "id": quantity.id,
        "title": quantity.words,
        "unit": quantity.unit,
        "low": low,
        "high": high,
        "lines": lines,
        "left_out": sum(curves.left_out for _, curves in own),
    }


def _line_json(side: str, curves: StrideCurves, unit: str, *, single: bool = True) -> dict[str, Any]:
    assert curves.mean is not None
    color, off = SIDE_COLORS[side], curves.foot_off_share
    return {
        "label": side,
        "trial": "",
        "style": "",
        "color": color.on_any_page,
        "ink": color.as_text,
        "mean": plain_numbers(curves.mean, unit),
        "std": None if curves.std is None else plain_numbers(curves.std, unit),
        "strides": plain_numbers(curves.values, unit) if single else [],
        "count": len(curves.cycles),
        "why": _strides_words(curves, unit),
        "foot_off": None if off is None else round(100 * off, 1),
    }


def _strides_words(curves: StrideCurves, unit: str) -> str:
    """Of how many strides, and how far each may be off by itself."""
    told = [counted(len(curves.cycles), "stride")]
    if curves.std is not None:
        told.append("±, band: standard deviation between strides")
    if curves.within is not None and np.isfinite(curves.within).all():
        told.append(f"standard deviation within a stride: {np.sqrt(np.mean(curves.within**2)):.3g} {unit}")
    return "; ".join(told)


def _reach(line: dict[str, Any]) -> Iterator[float]:
    """The extremes of what is drawn of a line."""
    mean, std = np.array(line["mean"]), np.array(line["std"] or 0.0)
    for values in (mean - std, mean + std, *map(np.array, line["strides"])):
        yield from (float(values.min()), float(values.max()))


def axis_limits(reached: Iterable[float]) -> tuple[float, float]:
    """An axis around zero and what is reached, with a little air; never without a length."""
    found = [0.0, *reached]
    low, high = min(found), max(found)
    air = AIR * (high - low)
    return (low - air if low < 0 else 0.0), (high + air if high > low else 1.0)


def _note(trial: CycledTrial, drawn: Sequence[dict[str, Any]], over_time_only: int) -> str:
    """What is not there, and why; empty where all is."""
    if not any(trial.cycles(side) for side in SIDES):
        return "No gait cycles: nobody walks or runs here from one contact of a foot to its next."
    told = []
    if missing := [chart["title"] for chart in drawn if not chart["lines"]]:
        told.append(f"No stride whose frames all count, so no curve: {', '.join(missing)}.")
    if left := max((chart["left_out"] for chart in drawn if chart["lines"]), default=0):
        are = "stride is" if left == 1 else "strides are"
        told.append(f"{left} {are} left out of torques and powers: not all frames count.")
    if over_time_only:
        told.append("Marker errors and plate forces are shown over time only.")
    return " ".join(told)
