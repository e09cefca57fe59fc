"""The section of the bench, made from its figures: sentences first."""

import platform
from collections.abc import Mapping, Sequence
from datetime import date

import numpy as np

from benchmarks.truth import tables
from benchmarks.truth.recorded import LIMIT_HZ
from benchmarks.truth.tables import (
    JOINTS,
    KINDS,
    Run,
    best_cutoff,
    geometric_mean,
    grouped,
    matched_synthetic_bands,
    pooled,
    ratio_of_best,
)
from benchmarks.truth.ways import LABORATORY, MARKER_FIT, OURS

SMALL_MM, LARGE_MM = (0.0, 0.1, 0.3, 1.0), (3.0, 5.0, 10.0)
REPORTED = ("pelvis", "hip flexion", "hip adduction", "hip rotation", "knee", "ankle")
ANGLES = tuple(dof for joint in REPORTED for dof in JOINTS[joint])
MOST_LISTED = 6


def account(known: Sequence[Run], references: Sequence[Run], matched_synthetics: Sequence[Run]) -> str:
    """Short plain sentences; those without figures are left out."""
    own = [r for r in known if r["model"] == "own"]
    sentences = [
        *_exact(own),
        *_against_best(own),
        *_matched_synthetics(matched_synthetics),
        *_experts(references),
    ]
    return "\n".join(["### What it shows", "", *(f"- {s}" for s in sentences)])


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


KNOWN = ("synthetic", "simulated")  # parts whose truth is known
ORDER = ("synthetic walk", "walk", "squat", "run", "sprint", "landing")


def section(cases: Sequence[Mapping], version: str) -> str:
    """Everything as Markdown.

    Args:
        cases: as the files hold them.
        version: of the code.
    """
    known = [_named(run, case) for case in cases if case["part"] in KNOWN for run in case["runs"]]
    known.sort(key=_order)
    real = [
        run for case in cases if case["part"] in ("recorded", "matched_synthetics") for run in case["runs"]
    ]
    kinds = {
        kind: [r for r in real if r["kind"] == kind]
        for kind in ("own markers", "reference", "lengths", "matched_synthetic")
    }
    first = [r for r in known if r["model"] == "own" and r["person"] == 0 and r["skin_mm"] in (0.0, 5.0)]
    own_markers, twins, labels = kinds["own markers"], kinds["matched_synthetic"], ("recording", "trial")
    of_skin, skin = ("activity", "skin_mm"), f"skin {tables.DETAILED_SKIN_MM:g} mm, own model"
    parts = {
        "(a) and (b): known truth": tables.truth_table(known),
        f"Torques by joint, {skin}": tables.joint_table(known, "torque"),
        f"Accelerations by joint, {skin}": tables.joint_table(known, "acceleration"),
        "Ranges of motion · peak speeds, own model": tables.range_table(known),
        "Gain and phase, own model, first person": tables.gain_table(first, of_skin, OURS),
        "The truth against the marker fit": tables.gain_table(first, of_skin, "truth"),
        "Bands: share of the frames whose 95 % band holds the truth": tables.band_table(
            [r for r in known if r["skin_mm"] >= LARGE_MM[0]], "activity", "model", "skin_mm"
        ),
        "Bands of twins": tables.band_table(twins, "activity", "matched_synthetic"),
        "Segments": tables.segment_table(known),
        "(c): against others' angles": tables.reference_table(kinds["reference"]),
        "Ranges of motion · peak speeds against the recording's own markers": tables.own_marker_table(
            own_markers
        ),
        "Gain and phase against the recording's own markers": tables.gain_table(own_markers, labels, OURS),
        "The laboratory's way": tables.gain_table(own_markers, labels, LABORATORY),
        "Twins: what gain is right": tables.matched_synthetic_gain_table(twins),
        "Twins: errors of whole trials": tables.matched_synthetic_table(twins),
        "Lengths against models scaled by hand": tables.length_table(kinds["lengths"]),
        "Not measured": "\n".join(f"- {c['part']} {c['of']}: {c['error']}" for c in cases if c["error"]),
    }
    minutes = sum(case["cpu_seconds"] for case in cases) / 60
    made = (
        f"{date.today()}, Python {platform.python_version()}, code {_versions(cases, version)}. Made by "
        f"`make bench-truth` ({minutes:.0f} minutes of CPU); the\nfigures are in `build/truth/*.json`."
    )
    text = [f"### {title}\n\n{table}" for title, table in parts.items() if table]
    return "\n\n".join(["## The figures", made, account(known, kinds["reference"], twins), *text])


def _named(run: Mapping, case: Mapping) -> Run:
    return {**run, "activity": "synthetic walk"} if case["part"] == "synthetic" else run


def _order(run: Run) -> tuple:
    return ORDER.index(str(run["activity"])), run["model"] != "own", run["skin_mm"], run["person"]


def _versions(cases: Sequence[Mapping], version: str) -> str:
    """What the figures were made by: the solver as it is, or what else."""
    old = [case for case in cases if case["version"] != version]
    return f"{version} ({len(old)} of {len(cases)} files of figures are of other code)" if old else version
