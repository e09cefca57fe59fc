"""A fit's figures against the bounds of the field."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from addb_viewer.report.markup import Safe, bar, element, joined, table, verdict_mark
from addb_viewer.text.held_out_words import KINDS, QUANTITIES, cutoff_words, worse_words
from addb_viewer.text.stored_words import stored_words
from solver.common.gravity import GRAVITY
from solver.dynamics.thresholds import Thresholds

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
    limits, weight = Thresholds(), mass_kg * GRAVITY
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


def held_out_table(trials: Sequence[Mapping[str, Any]]) -> Safe | None:
    """How well forces are predicted that the fit was not shown; None where none were held out.

    Args:
        trials: in the shape of `fit --json`.
    """
    rows = []
    for figures in trials:
        rows += _layout_rows(figures) or _first_layout_row(figures)
    head = (
        "Trial",
        "HeldOut",
        "Frames",
        "Force missed",
        "by markers alone",
        "Moment missed",
        "by markers alone",
        "Marker error, RMS",
    )
    return table(head, rows) if rows else None


def worse_than_markers(trials: Sequence[Mapping[str, Any]]) -> Safe | None:
    """Where the markers alone predict held-out forces better than the fit; None where they nowhere do.

    Args:
        trials: in the shape of `fit --json`.
    """
    said = [f"{figures['name']}: {words}." for figures in trials for words in worse_words(figures)]
    return element("ul", *(element("li", words) for words in said)) if said else None


def stored_list(trials: Sequence[Mapping[str, Any]]) -> Safe | None:
    """What recordings say of themselves, beside the table of what was found; None where they say nothing.

    Args:
        trials: in the shape of `fit --json`.
    """
    said = [
        f"{figures['name']}: {words}."
        for figures in trials
        for words in stored_words(figures.get("stored", ()))
    ]
    return element("ul", *(element("li", words) for words in said)) if said else None


def _layout_rows(figures: Mapping[str, Any]) -> list[list[str]]:
    held_out_layouts = figures.get("held_out_layouts") or {}
    rows = []
    for kind, words in KINDS.items():
        found = held_out_layouts.get(kind)
        if found:
            layouts = "1 layout" if found["layouts"] == 1 else f"{found['layouts']} layouts"
            pieces = words.removesuffix("s") if found["pieces"] == 1 else words
            row = [figures["name"], f"{found['pieces']} {pieces} in {layouts}", str(found["frames"])]
            for quantity, unit in QUANTITIES.items():
                of = found[quantity]
                alone = f"{_number(of['markers_rms'], unit, 1)} at {cutoff_words(of['markers_cutoffs_hz'])}"
                row += [_number(of["rms"], unit, 1), alone]
            rows.append([*row, _marker_errors(figures)])
    return rows


def _first_layout_row(figures: Mapping[str, Any]) -> list[list[str]]:
    """Before all layouts have come: the first one; markers as older versions filtered them are left out."""
    first = figures["held_out"]
    if first is None:
        return []
    row = [figures["name"], "first layout of blocks", str(first["frames"])]
    cutoffs = first.get("markers_cutoff_hz") or (None, None)
    for (name, key, unit), cutoff in zip(
        (("linear_residual", "rms_N", "N"), ("angular_residual", "rms_Nm", "N·m")), cutoffs, strict=True
    ):
        alone = _number(first[f"kinematics_only_{name}"][key], unit, 1)
        row += [_number(first[name][key], unit, 1), f"{alone} at {cutoff:g} Hz" if cutoff else ""]
    return [[*row, _marker_errors(figures)]]


def _marker_errors(figures: Mapping[str, Any]) -> str:
    """Now, and before forces were looked at."""
    alone = figures["kinematics_only"]
    before = _cm(alone["marker_rms_m"]) if alone else ""
    return f"{_cm(figures['marker_rms_m'])} ({before} markers alone)"


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
