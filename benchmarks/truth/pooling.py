"""Figures of several runs and coordinates as one number."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.truth.figures import TURNING
from benchmarks.truth.ways import CUTOFFS_HZ, OURS, at_cutoff

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


@dataclass(frozen=True)
class Kept:
    """How much of a joint's movement a recording's fit keeps, over its marker fit below a limit."""

    recording: str
    trial: str
    joint: str
    figure: str  # "range of motion" or "peak speed"
    percent: float
    is_kept: bool  # within what is asked for
    is_nearer: (
        bool | None
    )  # in both synthetics the fit is nearer to the truth than those markers; None: no synthetics


ASKED_PERCENT = {"range of motion": 2.0, "peak speed": 4.0}


def kept_movement(
    own_markers: Sequence[Run], matched_synthetics: Sequence[Run], joints: Sequence[str]
) -> list[Kept]:
    """Ranges of motion and peak speeds of recordings fitted to forces, and what synthetics say."""
    pairs = grouped(matched_synthetics, "recording", "trial")
    found = []
    for run in (r for r in own_markers if r["fitted_to_forces"]):
        where = (str(run["recording"]), str(run["trial"]))
        for joint in joints:
            for figure, asked in ASKED_PERCENT.items():
                percent = _over(run["against_marker_fit_below_limit"], figure, joint)
                if percent is None:
                    continue
                nearer = [
                    _is_nearer(matched_synthetic, figure, joint) for matched_synthetic in pairs.get(where, [])
                ]
                told = all(nearer) if nearer else None
                found.append(Kept(*where, joint, figure, percent, abs(percent) <= asked, told))
    return found


def _is_nearer(matched_synthetic: Run, figure: str, joint: str) -> bool:
    tables: dict[str, object] = matched_synthetic["against_marker_fit_below_limit"]  # type: ignore[assignment]
    ours, true = (_over(tables[who], figure, joint) for who in (OURS, "truth"))
    return ours is not None and true is not None and abs(ours - true) <= abs(true)


def _over(table: object, figure: str, joint: str) -> float | None:
    """By how many per cent a table's range or peak exceeds what it was compared with."""
    run = [{"ways": {OURS: table}}]
    if figure == "range of motion":
        return range_percent(run, OURS, JOINTS[joint])
    return peak_percent(run, OURS, "speed", JOINTS[joint])


def geometric_mean(ratios: Sequence[float]) -> float:
    """Of positive numbers."""
    return float(np.exp(np.mean(np.log(ratios))))
