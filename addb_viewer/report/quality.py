"""A fit's figures against the bounds of the field."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from addb_viewer.report.markup import Safe, bar, element, joined, table, verdict_mark
from solver.dynamics.thresholds import Thresholds
from solver.summary import STANDARD_GRAVITY

LARGEST_MARKER = "Largest marker error"
SOURCE = "Hicks et al. 2015 (10.1115/1.4029304)"


@dataclass(frozen=True)
class Judged:
    """One figure of a trial beside its bound."""

    label: str
    value: str  # with its unit; empty where it was not computed
    scaled: str  # the same in the bound's unit, where that is another
    bound: str
    share: float | None  # of the bound
    within: bool | None


def judged_figures(figures: Mapping[str, Any]) -> tuple[Judged, ...]:
    """The four figures that have a bound, and whether each is within.

    Args:
        figures: of a trial, in the shape of `fit --json`.
    """
    limits, hicks = Thresholds(), figures["hicks"]
    force, moment = figures["linear_residual"] or {}, figures["angular_residual"] or {}
    bw, bwh = force.get("rms_BW"), moment.get("rms_BWh")
    return (
        Judged(
            "Residual force, RMS",
            _number(force.get("rms_N"), "N", 1),
            _number(bw, "BW", 4),
            f"{limits.linear_BW:g} BW",
            _share(bw, limits.linear_BW),
            hicks["linear"],
        ),
        Judged(
            "Residual moment, RMS",
            _number(moment.get("rms_Nm"), "N·m", 1),
            _number(bwh, "BW·h", 4),
            f"{limits.angular_BWh:g} BW·h",
            _share(bwh, limits.angular_BWh),
            hicks["angular"],
        ),
        _marker("Marker error, RMS", figures["marker_rms_m"], limits.marker_rms_m, hicks["marker_rms"]),
        _marker(LARGEST_MARKER, figures["marker_max_m"], limits.marker_max_m, hicks["marker_max"]),
    )


def bounds_of(mass_kg: float, height_m: float) -> tuple[float, float]:
    """The bounds of a person's residual force [N] and moment [N·m]."""
    limits, weight = Thresholds(), mass_kg * STANDARD_GRAVITY
    return limits.linear_BW * weight, limits.angular_BWh * weight * height_m


def quality_table(trials: Sequence[Mapping[str, Any]]) -> Safe:
    """A row a trial, a column a figure.

    Args:
        trials: in the shape of `fit --json`.
    """
    judged = [judged_figures(figures) for figures in trials]
    head = ["Trial", *(joined((j.label, element("small", f"bound {j.bound}"))) for j in judged[0])]
    rows = [
        [figures["name"], *(_cell(j) for j in of_trial)]
        for figures, of_trial in zip(trials, judged, strict=True)
    ]
    return table(head, rows, "quality")


def withheld_table(trials: Sequence[Mapping[str, Any]]) -> Safe | None:
    """How well forces are foretold that the fit was not shown; None where none were withheld.

    Args:
        trials: in the shape of `fit --json`.
    """
    rows = []
    for figures in trials:
        withheld, alone = figures["heldout"], figures["kinematics_only"]
        if withheld is None:
            continue
        before = _cm(alone["marker_rms_m"]) if alone else ""
        rows.append(
            [
                figures["name"],
                str(withheld["frames"]),
                _number(withheld["linear_residual"]["rms_N"], "N", 1),
                _number(withheld["kinematics_only_linear_residual"]["rms_N"], "N", 1),
                _number(withheld["angular_residual"]["rms_Nm"], "N·m", 1),
                _number(withheld["kinematics_only_angular_residual"]["rms_Nm"], "N·m", 1),
                f"{_cm(figures['marker_rms_m'])} ({before} markers alone)",
            ]
        )
    head = (
        "Trial",
        "Frames withheld",
        "Force missed",
        "by the markers alone",
        "Moment missed",
        "by the markers alone",
        "Marker error, RMS",
    )
    return table(head, rows) if rows else None


def _marker(label: str, value_m: float | None, bound_m: float, within: bool | None) -> Judged:
    value = _cm(value_m) if value_m is not None else ""
    return Judged(label, value, "", f"{100 * bound_m:g} cm", _share(value_m, bound_m), within)


def _cell(judged: Judged) -> Safe:
    if judged.within is None:
        return verdict_mark(None)
    tone = "good" if judged.within else "bad"
    below = f"{judged.scaled}{', ' if judged.scaled else ''}{100 * (judged.share or 0.0):.0f} % of the bound"
    return joined(
        (
            element("b", judged.value),
            Safe(" "),
            verdict_mark(judged.within),
            bar(judged.share or 0.0, tone),
            element("small", below),
        )
    )


def _number(value: float | None, unit: str, digits: int) -> str:
    return "" if value is None else f"{value:.{digits}f} {unit}"


def _cm(value_m: float) -> str:
    return f"{100 * value_m:.2f} cm"


def _share(value: float | None, bound: float) -> float | None:
    return None if value is None else value / bound
