"""The page's tables, each made from the runs."""

from collections.abc import Sequence

from benchmarks.truth.figures import BANDS_HZ
from benchmarks.truth.pooling import (
    JOINTS,
    KINDS,
    MatchedSyntheticBand,
    Run,
    best_cutoff,
    grouped,
    lag,
    mass_shares,
    matched_synthetic_bands,
    peak_percent,
    pooled,
    range_percent,
)
from benchmarks.truth.recorded import LIMIT_HZ
from benchmarks.truth.ways import LABORATORY, MARKER_FIT, OURS, at_cutoff

DIGITS = {"angle": 2, "speed": 1, "acceleration": 2, "torque": 2}
FLEXIONS = ("hip flexion", "knee", "ankle")
JOINTS_BEARING = tuple(j for j in JOINTS if j != "pelvis")
DETAILED_SKIN_MM = 5.0


def truth_table(runs: Sequence[Run]) -> str:
    """Ours / marker fit / laboratory / marker fit at its best cut-off, for every amount of skin movement."""
    rows = []
    for (activity, model, skin), group in grouped(runs, "activity", "model", "skin_mm").items():
        cells = [activity, model, f"{skin:g}"]
        for kind in KINDS:
            cells.append(_side_by_side(group, kind))
        rows.append([*cells, _ratio_of_best(group)])
    return markdown(
        (
            "activity",
            "model",
            "skin mm",
            "angles °",
            "speeds °/s",
            "accelerations rad/s²",
            "torques N·m",
            "ours / best",
        ),
        rows,
    )


def _side_by_side(group: Sequence[Run], kind: str) -> str:
    digits = DIGITS[kind]
    ways = [pooled(group, way, kind) for way in (OURS, MARKER_FIT, LABORATORY)]
    best = best_cutoff(group, kind)
    if best is None or any(w is None for w in ways):
        return ""
    listed = " / ".join(f"{w:.{digits}f}" for w in ways)
    return f"{listed} / {best[1]:.{digits}f} ({best[0]:g} Hz)"


def ratio_of_best(group: Sequence[Run], kind: str) -> float | None:
    """Our error over that of the marker fit at its best cut-off."""
    ours, best = pooled(group, OURS, kind), best_cutoff(group, kind)
    return ours / best[1] if ours is not None and best and best[1] > 0 else None


def _ratio_of_best(group: Sequence[Run]) -> str:
    ratios = [ratio_of_best(group, kind) for kind in ("acceleration", "torque")]
    return " · ".join("–" if r is None else f"{r:.2f}" for r in ratios)


def joint_table(runs: Sequence[Run], kind: str) -> str:
    """By joint, one size of skin movement, the person's own model: RMS, its share of the peak, peak, lag."""
    rows = []
    own = [r for r in runs if r["model"] == "own" and r["skin_mm"] == DETAILED_SKIN_MM]
    for (activity,), group in grouped(own, "activity").items():
        for joint in JOINTS_BEARING:
            best = best_cutoff(group, kind, JOINTS[joint])
            ways = [OURS, MARKER_FIT, LABORATORY, *([at_cutoff(best[0])] if best else [])]
            cells = [_joint_cell(group, way, kind, joint) for way in ways]
            if best:
                cells[-1] += f"; {best[0]:g} Hz"
            rows.append([activity, joint, *cells])
    return markdown(("activity", "joint", OURS, MARKER_FIT, LABORATORY, "marker fit at its best"), rows)


def _joint_cell(group: Sequence[Run], way: str, kind: str, joint: str) -> str:
    dofs = JOINTS[joint]
    rms, peak = pooled(group, way, kind, dofs), pooled(group, way, kind, dofs, "peak")
    off, late = peak_percent(group, way, kind, dofs), lag(group, way, kind, dofs)
    if rms is None or peak is None or off is None:
        return ""
    share = 100 * rms / peak if peak else 0.0
    told = "–" if late is None else f"{late:+.1f} ms"
    return f"{rms:.{DIGITS[kind]}f} ({share:.0f} %); peak {off:+.0f} %; {told}"


def range_table(runs: Sequence[Run]) -> str:
    """Ranges of motion and peak speeds, per cent of the true ones, the person's own model."""
    rows = []
    own = [r for r in runs if r["model"] == "own" and r["skin_mm"] in (0.0, DETAILED_SKIN_MM)]
    for (activity, skin), group in grouped(own, "activity", "skin_mm").items():
        for joint in FLEXIONS:
            cells = [activity, f"{skin:g}", joint]
            for way in (OURS, MARKER_FIT, LABORATORY):
                spread, peak = (
                    range_percent(group, way, JOINTS[joint]),
                    peak_percent(group, way, "speed", JOINTS[joint]),
                )
                cells.append(f"{_signed(spread)} · {_signed(peak)}")
            rows.append(cells)
    return markdown(("activity", "skin mm", "joint", OURS, MARKER_FIT, LABORATORY), rows)


def gain_table(runs: Sequence[Run], labels: Sequence[str], way: str) -> str:
    """Gain and phase against the unfiltered marker fit, by band; the band's own content in ° if tiny."""
    bands = [f"{low:g}–{high:g} Hz" for low, high in BANDS_HZ]
    rows = []
    for run in runs:
        for joint, table in run["gains"].get(way, {}).items():  # type: ignore[attr-defined]
            found = {b["low_Hz"]: b for b in table}
            cells = [_gain_cell(found.get(low)) for low, _ in BANDS_HZ]
            rows.append([*(_plain(run[label]) for label in labels), joint, *cells])
    return markdown((*labels, "joint", *bands), rows)


def _gain_cell(band: dict | None) -> str:
    return (
        "" if band is None else f"{band['gain']:.2f} ({band['phase_deg']:+.0f}°; {band['content_deg']:.2f})"
    )


def segment_table(runs: Sequence[Run]) -> str:
    """Masses over the true ones, lengths less the true ones; worst and mean over people."""
    rows = []
    shown = [r for r in runs if r["skin_mm"] in (0.0, DETAILED_SKIN_MM, 3.0, 10.0)]
    for (activity, model, skin), group in grouped(shown, "activity", "model", "skin_mm").items():
        masses = [_each(group, "mass_ratios", p, ".2f") for p in ("trunk", "thigh", "shank", "foot")]
        lengths = [
            _each(group, "length_errors_mm", p, "+.0f") for p in ("hip width", "thigh", "shank", "foot")
        ]
        rows.append([activity, model, f"{skin:g}", *masses, *lengths])
    return markdown(
        (
            *("activity", "model", "skin mm"),
            *("trunk mass", "thigh mass", "shank mass", "foot mass"),
            *("hip width mm", "thigh mm", "shank mm", "foot mm"),
        ),
        rows,
    )


def _each(group: Sequence[Run], kind: str, part: str, form: str) -> str:
    """A segment's figure of each person."""
    tables: list[dict[str, float]] = [r[kind] for r in group]  # type: ignore[misc]
    return " ".join(format(t[part], form) for t in tables if part in t)


def reference_table(runs: Sequence[Run]) -> str:
    """Angles of experts and of engines: ours / marker fit / laboratory, offsets removed."""
    rows = []
    for run in runs:
        cells = [
            str(run["recording"]),
            str(run["trial"]),
            str(run["whose"]),
            f"`{run['angles']}` on `{run['model']}`",
        ]
        for joint in ("pelvis", "hip flexion", "hip adduction", "hip rotation", "knee", "ankle"):
            ways = [
                pooled([run], way, "angle", JOINTS[joint], "rms_without_offset")
                for way in (OURS, MARKER_FIT, LABORATORY)
            ]
            cells.append(" / ".join("–" if w is None else f"{w:.2f}" for w in ways))
        rows.append(cells)
    return markdown(
        (
            *("recording", "trial", "whose", "angles on model"),
            *("pelvis", "hip flexion", "hip adduction", "hip rotation", "knee", "ankle"),
        ),
        rows,
    )


def reference_torque_table(runs: Sequence[Run]) -> str:
    """Torques where somebody published them."""
    rows = []
    for run in runs:
        if run["torques"] is None:
            continue
        for joint in JOINTS_BEARING:
            cells = [_joint_cell([run], way, "torque", joint) for way in (OURS, MARKER_FIT, LABORATORY)]
            if any(cells):
                rows.append([str(run["recording"]), f"`{run['torques']}`", joint, *cells])
    return markdown(("recording", "torques", "joint", OURS, MARKER_FIT, LABORATORY), rows)


def own_marker_table(runs: Sequence[Run]) -> str:
    """Ranges of motion and peak speeds of real recordings against their marker fit below the limit."""
    rows = []
    for run in runs:
        group = [{"ways": {OURS: run["against_marker_fit_below_limit"]}}]
        cells = [str(run["recording"]), str(run["trial"]), str(run["activity"])]
        for joint in FLEXIONS:
            spread = range_percent(group, OURS, JOINTS[joint])
            cells.append(f"{_signed(spread)} · {_signed(peak_percent(group, OURS, 'speed', JOINTS[joint]))}")
        masses = mass_shares(run)
        cells += [f"{masses[p]:.2f}" if p in masses else "" for p in ("trunk", "thigh", "shank", "foot")]
        rows.append([*cells, "" if run["fitted_to_forces"] else "not fitted to forces"])
    return markdown(
        (
            *("recording", "trial", "activity"),
            *FLEXIONS,
            *("trunk mass", "thigh mass", "shank mass", "foot mass", ""),
        ),
        rows,
    )


def matched_synthetic_gain_table(runs: Sequence[Run]) -> str:
    """What gain each recording has, what its synthetics say is right, and whose error is smaller there."""
    bands = [(low, high) for low, high in BANDS_HZ if high <= max(LIMIT_HZ.values())]
    rows = []
    for (recording, trial, activity), pair in grouped(runs, "recording", "trial", "activity").items():
        told = matched_synthetic_bands(pair, LIMIT_HZ[activity])
        for joint in dict.fromkeys(b.joint for b in told):
            of_band = {b.low_Hz: b for b in told if b.joint == joint}
            cells = [_matched_synthetic_cell(of_band[low]) if low in of_band else "" for low, _ in bands]
            rows.append([recording, trial, joint, *cells])
    return markdown(("recording", "trial", "joint", *(f"{low:g}–{high:g} Hz" for low, high in bands)), rows)


def _matched_synthetic_cell(band: MatchedSyntheticBand) -> str:
    right = " ".join(f"{gain:.2f}" for gain in band.right)
    ours, markers = (" ".join(f"{e:.2f}" for e in x) for x in (band.ours_deg, band.markers_deg))
    return f"{band.gain:.2f}; right {right}; {ours} ({markers})"


def matched_synthetic_table(runs: Sequence[Run]) -> str:
    """Errors of the matched synthetics, all of legs and trunk."""
    rows = []
    for run in runs:
        cells = [str(run[label]) for label in ("recording", "trial", "matched_synthetic")]
        for kind in KINDS:
            ways = [pooled([run], way, kind) for way in (OURS, MARKER_FIT)]
            best = best_cutoff([run], kind)
            listed = " / ".join("–" if w is None else f"{w:.{DIGITS[kind]}f}" for w in ways)
            cells.append(f"{listed} / {best[1]:.{DIGITS[kind]}f} ({best[0]:g} Hz)" if best else "")
        rows.append(cells)
    units = ("angles °", "speeds °/s", "accelerations rad/s²", "torques N·m")
    return markdown(("recording", "trial", "matched_synthetic", *units), rows)


def length_table(runs: Sequence[Run]) -> str:
    """Lengths against models that somebody scaled by hand."""
    names = ("hip width", "thigh", "shank", "foot")
    rows = []
    for run in runs:
        if "error" in run:
            rows.append([str(run["recording"]), "default body", str(run["error"]), *[""] * len(names)])
            continue
        lengths: dict[str, float] = run["length_errors_mm"]  # type: ignore[assignment]
        rows.append(
            [
                str(run["recording"]),
                str(run["body"]),
                f"`{run['hand_scaled']}`",
                *(f"{lengths[n]:+.0f}" if n in lengths else "" for n in names),
            ]
        )
    return markdown(("recording", "our body", "scaled by hand", *names), rows)


def markdown(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table, or a word that there is nothing to show."""
    if not rows:
        return "Nothing measured yet."
    lines = [f"| {' | '.join(header)} |", "|" + "---|" * len(header)]
    return "\n".join(lines + [f"| {' | '.join(row)} |" for row in rows])


def _signed(percent: float | None) -> str:
    return "–" if percent is None else f"{percent:+.0f} %"


def _plain(label: object) -> str:
    return f"{label:g}" if isinstance(label, float) else str(label)
