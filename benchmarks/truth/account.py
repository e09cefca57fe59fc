"""What the figures say, in sentences that are made from them."""

from collections.abc import Sequence

import numpy as np

from benchmarks.truth.figures import FLEXION
from benchmarks.truth.pooling import (
    ASKED_PERCENT,
    JOINTS,
    KINDS,
    Run,
    best_cutoff,
    geometric_mean,
    grouped,
    kept_movement,
    mass_shares,
    matched_synthetic_bands,
    pooled,
)
from benchmarks.truth.recorded import LIMIT_HZ
from benchmarks.truth.tables import FLEXIONS, ratio_of_best
from benchmarks.truth.ways import LABORATORY, MARKER_FIT, OURS

SMALL_MM, LARGE_MM = (0.0, 0.1, 0.3, 1.0), (3.0, 5.0, 10.0)
REPORTED = ("pelvis", "hip flexion", "hip adduction", "hip rotation", "knee", "ankle")
ANGLES = tuple(dof for joint in REPORTED for dof in JOINTS[joint])
MOST_PHASE_DEG = 5.0
MOST_LISTED = 6
TOLD_HZ = {"walk": 4.0, "run": 6.0, "sprint": 6.0, "jump": 6.0, "squat": 2.0, "sit": 2.0}  # bands of 2 Hz


def account(
    known: Sequence[Run],
    own_markers: Sequence[Run],
    references: Sequence[Run],
    matched_synthetics: Sequence[Run],
) -> str:
    """Short plain sentences; those without figures are left out."""
    own = [r for r in known if r["model"] == "own"]
    sentences = [
        *_exact(own),
        *_against_best(own),
        *_smoothly(own),
        *_gains(own_markers),
        *_phases(own_markers),
        *_kept(own_markers, matched_synthetics),
        *_matched_synthetics(matched_synthetics),
        *_experts(references),
        *_masses(known, own_markers),
    ]
    return "\n".join(["## What it shows", "", *(f"- {s}" for s in sentences)])


def _exact(own: Sequence[Run]) -> list[str]:
    found = []
    for (activity,), group in grouped([r for r in own if r["skin_mm"] == 0.0], "activity").items():
        angle = [pooled(group, way, "angle") for way in (OURS, MARKER_FIT)]
        torque = [pooled(group, way, "torque") for way in (OURS, MARKER_FIT)]
        if None not in angle + torque:
            found.append(
                f"{activity} {angle[0]:.2f}° and {torque[0]:.1f} N·m (marker fit {angle[1]:.2f}° and "
                f"{torque[1]:.1f} N·m)"
            )
    return [f"**Exact markers, own model.** Our errors: {'; '.join(found)}."] if found else []


def _against_best(own: Sequence[Run]) -> list[str]:
    """The first bars of all: ours and the marker fit at its best cut-off."""
    sentences: list[str] = []
    above: dict[str, np.ndarray] = {}
    ratios: dict[str, list[float]] = {}
    for (activity,), runs in grouped(own, "activity").items():
        for (size,), group in grouped(runs, "skin_mm").items():
            if size in SMALL_MM:
                found = [_excess(group, kind) for kind in ("angle", "torque")]
                above[activity] = np.fmax(above.get(activity, -np.inf), found)
            else:
                each = [ratio_of_best(group, kind) for kind in ("acceleration", "torque")]
                ratios.setdefault(activity, []).extend(r for r in each if r is not None)
    if above:
        listed = ", ".join(f"{activity} {a:.2f}° and {t:.1f} N·m" for activity, (a, t) in above.items())
        sentences.append(
            "**Skin movement of 0 to 1 mm, own model**: our errors exceed those of the marker fit at its "
            f"best cut-off by up to: {listed}."
        )
    if ratios:
        means = {activity: geometric_mean(found) for activity, found in ratios.items()}
        listed = ", ".join(f"{activity} {mean:.2f}" for activity, mean in means.items())
        sentences.append(
            "**Skin movement of 3 to 10 mm, own model**: our errors of accelerations and torques over those "
            "of the marker fit at its best cut-off, geometric mean: "
            f"{geometric_mean(list(means.values())):.2f} ({listed})."
        )
    laboratory = [r for r in own if r["skin_mm"] in LARGE_MM]
    ours = {k: (pooled(laboratory, OURS, k), pooled(laboratory, LABORATORY, k)) for k in ("angle", "torque")}
    if laboratory and None not in ours["angle"] + ours["torque"]:
        sentences.append(
            f"**Against the laboratory's way** at 3 to 10 mm, all activities: angles {ours['angle'][0]:.2f}° "
            f"where it has {ours['angle'][1]:.2f}°, torques {ours['torque'][0]:.1f} N·m where it has "
            f"{ours['torque'][1]:.1f} N·m."
        )
    return sentences


def _excess(group: Sequence[Run], kind: str) -> float:
    ours, best = pooled(group, OURS, kind), best_cutoff(group, kind)
    return ours - best[1] if ours is not None and best is not None else np.nan


def _smoothly(own: Sequence[Run]) -> list[str]:
    """How the error of the torques grows with the noise."""
    found = []
    for (activity,), runs in grouped(own, "activity").items():
        time_history = []
        for (size,), group in grouped(runs, "skin_mm").items():
            ours, best = pooled(group, OURS, "torque"), best_cutoff(group, "torque")
            if ours is not None and best is not None and size in (0.0, 1.0, 3.0, 10.0):
                time_history.append(f"{ours:.1f} ({best[1]:.1f})")
        if time_history:
            found.append(f"{activity} {', '.join(time_history)}")
    return (
        [
            "**Torques as the skin moves more** (0, 1, 3, 10 mm; in brackets the marker fit at its best), "
            f"N·m: {'; '.join(found)}."
        ]
        if found
        else []
    )


def _gains(own_markers: Sequence[Run]) -> list[str]:
    sentences = []
    for activity, low in TOLD_HZ.items():
        found = [
            band["gain"]
            for run in own_markers
            if run["activity"] == activity and run["fitted_to_forces"]
            for joint in FLEXION
            for band in run["gains"][OURS].get(joint, [])  # type: ignore[index]
            if band["low_Hz"] == low
        ]
        if found:
            sentences.append(f"{activity} {min(found):.2f} to {max(found):.2f} at {low:g}–{low + 2:g} Hz")
    if not sentences:
        return []
    listed = "; ".join(sentences)
    return [f"**Gain on real recordings** against their own marker fit, hip, knee and ankle: {listed}."]


def _phases(own_markers: Sequence[Run]) -> list[str]:
    """How far bands below the limit lead or lag the marker fit."""
    found = [
        (abs(band["phase_deg"]), f"{run['recording']} {run['trial']} {joint} from {band['low_Hz']:g} Hz")
        for run in own_markers
        if run["fitted_to_forces"]
        for joint, bands in run["gains"][OURS].items()  # type: ignore[index]
        for band in bands
        if band["high_Hz"] <= LIMIT_HZ[str(run["activity"])]
    ]
    if not found:
        return []
    far = [f"{where} {phase:.0f}°" for phase, where in sorted(found, reverse=True) if phase > MOST_PHASE_DEG]
    others = f"; the others: {_listed(far)}" if far else ""
    return [
        "**Phase on real recordings** against their own marker fit, below the limit: within "
        f"{MOST_PHASE_DEG:g}° in {len(found) - len(far)} of {len(found)} joints and bands{others}."
    ]


def _kept(own_markers: Sequence[Run], matched_synthetics: Sequence[Run]) -> list[str]:
    """Ranges and peak speeds against what is asked for, and whether the missing part was movement."""
    told = kept_movement(own_markers, matched_synthetics, FLEXIONS)
    sentences = []
    for figure, asked in ASKED_PERCENT.items():
        those = [k for k in told if k.figure == figure]
        if not those:
            continue
        beyond = [k for k in those if not k.is_kept]
        nearer = sum(k.is_nearer is True for k in beyond)
        by_size = sorted(beyond, key=lambda k: -abs(k.percent))
        worse = [
            f"{k.recording} {k.trial} {k.joint} {k.percent:+.0f} %"
            for k in by_size
            if k.is_nearer is not True
        ]
        others = f" The others: {_listed(worse)}." if worse else ""
        sentences.append(
            f"**{figure.capitalize()} on real recordings** against the marker fit below the limit: within "
            f"{asked:g} % for {len(those) - len(beyond)} of {len(those)} joints. Of the other {len(beyond)} "
            f"the fit is nearer to the truth than those markers in both synthetics in {nearer}.{others}"
        )
    return sentences


def _listed(items: Sequence[str]) -> str:
    """The first few; the tables below have all."""
    few = "; ".join(items[:MOST_LISTED])
    return few if len(items) <= MOST_LISTED else f"{few}; and {len(items) - MOST_LISTED} more"


def _matched_synthetics(matched_synthetics: Sequence[Run]) -> list[str]:
    """Whether a gain below 1 is right, by recordings whose truth is known and whose noise is a real one's."""
    if not matched_synthetics:
        return []
    means = []
    for kind in KINDS:
        ratios = [ratio_of_best([r], kind) for r in matched_synthetics]
        means.append(f"{geometric_mean([r for r in ratios if r is not None]):.2f} in {kind}s")
    worse = []
    told = []
    for (recording, trial, activity), pair in grouped(
        matched_synthetics, "recording", "trial", "activity"
    ).items():
        bands = [b for b in matched_synthetic_bands(pair, LIMIT_HZ[activity]) if b.is_bent]
        told += bands
        worse += [f"{recording} {trial} {b.joint} from {b.low_Hz:g} Hz" for b in bands if not b.is_nearer]
    others = f" The others: {_listed(worse)}." if worse else ""
    return [
        f"**Matched synthetics** ({len(matched_synthetics)}, known motion under recorded noise and forces): "
        f"our errors over those of the marker fit at its best cut-off, geometric mean: {', '.join(means)}. "
        f"Of {len(told)} joints and bands in which a recording's gain leaves 0.95 to 1.05 below the limit of "
        f"its activity, our error there is smaller in both synthetics in {len(told) - len(worse)}.{others}"
    ]


def _experts(references: Sequence[Run]) -> list[str]:
    by_hand = [r for r in references if "engine" not in str(r["whose"])]
    each = [_off(by_hand, way) for way in (OURS, MARKER_FIT, LABORATORY)]
    if None in each:
        return []
    pairs = [(_off([r], OURS), _off([r], MARKER_FIT)) for r in by_hand]
    worse = sum(ours is not None and markers is not None and ours > markers + 0.2 for ours, markers in pairs)
    return [
        f"**People's angles** ({len(by_hand)} sets, offsets removed, pelvis and legs): ours {each[0]:.2f}°, "
        f"marker fit {each[1]:.2f}°, laboratory {each[2]:.2f}°. On {worse} of them ours is more than 0.2° "
        "worse than the marker fit."
    ]


def _off(runs: Sequence[Run], way: str) -> float | None:
    return pooled(runs, way, "angle", ANGLES, "rms_without_offset")


def _masses(known: Sequence[Run], own_markers: Sequence[Run]) -> list[str]:
    true = [r["mass_ratios"] for r in known]
    shares = [mass_shares(r) for r in own_markers if r["fitted_to_forces"]]
    sentences = []
    for name, ratios in (
        ("against the true ones, simulated and synthetic", true),
        ("as shares of the body, against the scaled model's, real recordings", shares),
    ):
        found = []
        for part in ("trunk", "thigh", "shank", "foot"):
            each: list[float] = [table[part] for table in ratios if part in table]  # type: ignore[index,operator]
            if each:
                found.append(f"{part} {min(each):.2f} to {max(each):.2f}")
        if found:
            sentences.append(f"**Segment masses** {name}: {', '.join(found)}.")
    return sentences
