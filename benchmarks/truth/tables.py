"""Figures of several runs and coordinates as one number, and the page's tables, each made from the runs."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.markdown import table
from benchmarks.truth.bands import KINDS as BANDED
from benchmarks.truth.figures import BANDS_HZ, TURNING
from benchmarks.truth.recorded import LIMIT_HZ
from benchmarks.truth.ways import CUTOFFS_HZ, LABORATORY, MARKER_FIT, OURS, at_cutoff

Run = Mapping[str, object]
KINDS = ("angle", "speed", "acceleration", "torque")
BODY = tuple(d for d in TURNING if not d.startswith("pelvis"))  # legs and trunk
JOINTS = {
    "pelvis": ("pelvis_tilt", "pelvis_list", "pelvis_rotation"),
    "trunk": ("lumbar_extension", "lumbar_bending", "lumbar_rotation"),
    "hip flexion": ("hip_flexion_r", "hip_flexion_l"),
    "hip adduction": ("hip_adduction_r", "hip_adduction_l"),
    "hip rotation": ("hip_rotation_r", "hip_rotation_l"),
    "knee": ("knee_angle_r", "knee_angle_l"),
    "ankle": ("ankle_angle_r", "ankle_angle_l"),
}


def values(runs: Sequence[Run], way: str, kind: str, figure: str, dofs: Iterable[str] = BODY) -> list[float]:
    """One figure of every run and coordinate that has it."""
    found = []
    for run in runs:
        table = run["ways"].get(way, {}).get(kind, {})  # type: ignore[attr-defined]
        found += [table[d][figure] for d in dofs if d in table and table[d][figure] is not None]
    return found


def pooled(
    runs: Sequence[Run], way: str, kind: str, dofs: Iterable[str] = BODY, figure: str = "rms"
) -> float | None:
    """Root mean square of that figure over runs and coordinates; None where there is none."""
    found = values(runs, way, kind, figure, dofs)
    return float(np.sqrt(np.mean(np.square(found)))) if found else None


def best_cutoff(
    runs: Sequence[Run], kind: str, dofs: Iterable[str] = BODY, figure: str = "rms"
) -> tuple[float, float] | None:
    """The cut-off [Hz] at which the marker fit comes nearest to the truth, and how near."""
    tried = [(pooled(runs, at_cutoff(hertz), kind, dofs, figure), hertz) for hertz in CUTOFFS_HZ]
    known = [(value, hertz) for value, hertz in tried if value is not None]
    if not known:
        return None
    value, hertz = min(known)
    return hertz, value


def grouped(runs: Iterable[Run], *keys: str) -> dict[tuple, list[Run]]:
    """Runs by these labels, in the order in which they come."""
    found: dict[tuple, list[Run]] = {}
    for run in runs:
        found.setdefault(tuple(run[k] for k in keys), []).append(run)
    return found


def peak_percent(runs: Sequence[Run], way: str, kind: str, dofs: Iterable[str]) -> float | None:
    """How much the peak is exceeded (or missed, below zero), in per cent of the true one; the mean."""
    excess, peak = values(runs, way, kind, "peak_excess", dofs), values(runs, way, kind, "peak", dofs)
    return 100 * float(np.sum(excess) / np.sum(peak)) if peak else None


def range_percent(runs: Sequence[Run], way: str, dofs: Iterable[str]) -> float | None:
    """How much the range of motion is exceeded, in per cent of the true one; the mean."""
    excess, true = values(runs, way, "angle", "range_excess", dofs), values(runs, way, "angle", "range", dofs)
    return 100 * float(np.sum(excess) / np.sum(true)) if true else None


def lag(runs: Sequence[Run], way: str, kind: str, dofs: Iterable[str]) -> float | None:
    """Mean lag [ms]."""
    found = values(runs, way, kind, "lag_ms", dofs)
    return float(np.mean(found)) if found else None


def mass_shares(run: Run) -> dict[str, float]:
    """Each part's share of the body's mass, fitted over the scaled model's."""
    masses: dict[str, float] = run["mass_ratios"]  # type: ignore[assignment]
    return {part: ratio / masses["body"] for part, ratio in masses.items() if part != "body"}


@dataclass(frozen=True)
class MatchedSyntheticBand:
    """What both matched synthetics of a recording say of a joint in a frequency band."""

    joint: str
    low_Hz: float
    gain: float  # of the recording itself
    right: tuple[float, ...]  # of the truth against the marker fit, by matched synthetic
    ours_deg: tuple[float, ...]  # error, by matched synthetic
    markers_deg: tuple[float, ...]  # of the marker fit at the cut-off that is best for the band

    @property
    def is_bent(self) -> bool:
        """The recording's gain leaves what is asked for, 0.95 to 1.05."""
        return not 0.95 <= self.gain <= 1.05

    @property
    def is_nearer(self) -> bool:
        """In both synthetics the fit is nearer to the truth than the markers at any cut-off, within 5 %."""
        return all(a <= 1.05 * b for a, b in zip(self.ours_deg, self.markers_deg, strict=True))


def matched_synthetic_bands(pair: Sequence[Run], limit_Hz: float) -> list[MatchedSyntheticBand]:
    """Of both matched synthetics of one recording, in bands below the limit.

    Args:
        pair: the runs of the matched synthetics.
        limit_Hz: up to which a gain of 1 is asked for.
    """
    found = []
    of_recording: dict[str, list[dict[str, float]]] = pair[0]["gains_of_recording"]  # type: ignore[assignment]
    for joint, bands in of_recording.items():
        for k, band in enumerate(bands):
            if band["high_Hz"] > limit_Hz:
                continue
            errors = [{w: t[joint][k]["error_deg"] for w, t in r["errors_by_band"].items()} for r in pair]  # type: ignore[attr-defined]
            found.append(
                MatchedSyntheticBand(
                    joint,
                    band["low_Hz"],
                    band["gain"],
                    tuple(r["gains"]["truth"][joint][k]["gain"] for r in pair),  # type: ignore[index]
                    tuple(e[OURS] for e in errors),
                    tuple(min(v for w, v in e.items() if w != OURS) for e in errors),
                )
            )
    return found


def geometric_mean(ratios: Sequence[float]) -> float:
    """Of positive numbers."""
    return float(np.exp(np.mean(np.log(ratios))))


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
    return table(
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
    return table(("activity", "joint", OURS, MARKER_FIT, LABORATORY, "marker fit at its best"), rows)


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
    return table(("activity", "skin mm", "joint", OURS, MARKER_FIT, LABORATORY), rows)


def gain_table(runs: Sequence[Run], labels: Sequence[str], way: str) -> str:
    """Gain and phase against the unfiltered marker fit, by band; the band's own content in ° if tiny."""
    bands = [f"{low:g}–{high:g} Hz" for low, high in BANDS_HZ]
    rows = []
    for run in runs:
        for joint, bands_of in run["gains"].get(way, {}).items():  # type: ignore[attr-defined]
            found = {b["low_Hz"]: b for b in bands_of}
            cells = [_gain_cell(found.get(low)) for low, _ in BANDS_HZ]
            rows.append([*(_plain(run[label]) for label in labels), joint, *cells])
    return table((*labels, "joint", *bands), rows)


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
    return table(
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
    return table(
        (
            *("recording", "trial", "whose", "angles on model"),
            *("pelvis", "hip flexion", "hip adduction", "hip rotation", "knee", "ankle"),
        ),
        rows,
    )


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
    return table(
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
    return table(("recording", "trial", "joint", *(f"{low:g}–{high:g} Hz" for low, high in bands)), rows)


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
    return table(("recording", "trial", "matched_synthetic", *units), rows)


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
    return table(("recording", "our body", "scaled by hand", *names), rows)


def _signed(percent: float | None) -> str:
    return "–" if percent is None else f"{percent:+.0f} %"


def _plain(label: object) -> str:
    return f"{label:g}" if isinstance(label, float) else str(label)


def band_table(runs: Sequence[Run], *labels: str) -> str:
    """Coverage of 95 % bands by these labels, with the joint that is worst and the width over the error."""
    rows = []
    for values, group in grouped([r for r in runs if r.get("bands")], *labels).items():
        cells = [_cell([r["bands"][kind] for r in group if kind in r["bands"]]) for kind in BANDED]
        rows.append([*(str(v) for v in values), *cells])
    return table([*labels, *(f"{kind}s" for kind in BANDED)], rows) if rows else ""


def _cell(found: Sequence[Mapping[str, Sequence[float]]]) -> str:
    by_joint: dict[str, list[Sequence[float]]] = {}
    for one in found:
        for name, figures in one.items():
            by_joint.setdefault(name.removesuffix("_r").removesuffix("_l"), []).append(figures)
    if not by_joint:
        return ""
    covered = {name: float(np.mean([f[0] for f in each])) for name, each in by_joint.items()}
    width = np.median([f[1] for each in by_joint.values() for f in each])
    worst = min(covered, key=lambda name: covered[name])
    mean = float(np.mean([f[0] for each in by_joint.values() for f in each]))
    return f"{100 * mean:.0f} % ({worst} {100 * covered[worst]:.0f}), {width:.1f}"
