"""The numbers of every table and figure, as rows with named columns, from one pass over all frames."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from jaxtyping import Bool, Float

from addb_viewer.dataset.columns import COORDINATE_NAMES
from addb_viewer.dataset.reader import by_trial, column, read_table, vector

GRAVITY = 9.80665  # [m/s²]
EVERY = 20  # frames, between two points of a scatter plot: 5 a second
MOST_POINTS = 50_000
LOADED_N = 20.0  # [N] vertical force of both feet, below which it has no share
SEED = 0

CLASSES = {
    "walk": "walking",
    "run": "running",
    "stairs": "stairs",
    "sit-to-stand": "sit-to-stand",
    "jump": "jump",
    "squat": "squat",
    "lunge": "lunge",
    "standing": "standing",
    "transition": "other",  # counted so by the paper's tools
    "other": "other",
}
UNLABELLED = "unlabelled"


Rows = list[dict[str, Any]]


class Frames(StrEnum):
    """Which frames a figure is about; of all of them, every force counts."""

    PAPER = "paper"  # reviewed, and detection finds no fault by itself either
    REVIEWED = "reviewed"  # of trials that a person has finished
    ALL = "all"


@dataclass(frozen=True)
class Gathered:
    """What figures are made from."""

    subjects: Rows
    trials: Rows
    segments: Rows  # with the figures of the chosen frames
    hours: dict[tuple[str, str], float]  # of chosen frames, by source and class
    points: Rows  # frames of the scatter plots


def gathered(release: Path, frames: Frames) -> Gathered:
    """Read a release once.

    Args:
        release: its folder.
        frames: which of them figures are about.

    Raises:
        ReleaseError: a table is missing or cannot be read.
    """
    subjects = {row["subject_id"]: row for row in read_table(release / "subjects.parquet").to_pylist()}
    trials = {row["trial_id"]: row for row in read_table(release / "trials.parquet").to_pylist()}
    segments = {
        (r["trial_id"], r["segment"]): r for r in read_table(release / "segments.parquet").to_pylist()
    }
    hours: dict[tuple[str, str], float] = {}
    points: Rows = []
    rng = np.random.default_rng(SEED)
    for file in sorted((release / "frames").glob("*.parquet")):
        table = read_table(file)
        centres = read_table(release / "joint_centres" / file.name)
        for trial_id, part in by_trial(table):
            trial = trials[trial_id]
            subject = subjects[trial["subject_id"]]
            chosen = chosen_frames(part, trial, frames)
            _count_hours(part, chosen, step_s(trial), str(subject["source"]), hours)
            _fill_segments(part, chosen, subject, trial_id, segments)
            points += _points(part, chosen, subject, trial_id, centres)
        points = _thinned(points, rng)
    return Gathered(
        list(subjects.values()), list(trials.values()), list(segments.values()), hours, _alike(points)
    )


def chosen_frames(table: pa.Table, trial: Mapping[str, Any], frames: Frames) -> Bool[np.ndarray, " rows"]:
    """Which rows of a trial a figure is about.

    Args:
        table: the trial's rows of `frames`.
        trial: its row of `trials`.
        frames: the choice.
    """
    counts = column(table, "counts") > 0
    if frames is Frames.ALL:
        return counts
    if not trial["reviewed"]:
        return np.zeros_like(counts)
    return counts if frames is Frames.REVIEWED else counts & (column(table, "detected_ok") > 0)


def step_s(trial: Mapping[str, Any]) -> float:
    """Between two frames of the release's grid [s].

    Args:
        trial: its row of `trials`.
    """
    return float(trial["duration_s"]) / max(1, int(trial["frames"]) - 1)


def _count_hours(
    table: pa.Table,
    chosen: Bool[np.ndarray, " rows"],
    step_s: float,
    source: str,
    hours: dict[tuple[str, str], float],
) -> None:
    labels = np.asarray(table["activity"].to_pylist(), dtype=object)[chosen]
    for label, count in zip(*np.unique(labels.astype(str), return_counts=True), strict=True):
        key = source, CLASSES.get(str(label), UNLABELLED)
        hours[key] = hours.get(key, 0.0) + float(count) * step_s / 3600


def _fill_segments(
    table: pa.Table,
    chosen: Bool[np.ndarray, " rows"],
    subject: Mapping[str, Any],
    trial_id: str,
    segments: dict[tuple[str, int], dict[str, Any]],
) -> None:
    """Add what the chosen frames of each segment say."""
    number, phase = column(table, "segment"), np.nan_to_num(column(table, "phase"), nan=-1)
    used = chosen & (column(table, "used") > 0)
    weight = float(subject["mass_kg"]) * GRAVITY
    force = vector(table, "residual_force_{}_N") / weight
    moment = vector(table, "residual_moment_{}_Nm") / (weight * float(subject["height_m"]))
    marker = column(table, "marker_rms_m")
    for segment in np.unique(number):
        inside = number == segment
        of_phase = phase[inside & chosen]
        known = of_phase >= 0
        row = segments[trial_id, int(segment)]
        row["rows"] = int(inside.sum())
        row["chosen"] = int((inside & chosen).sum())
        row["used"] = int((inside & used).sum())
        row["flight_percent"] = _percent(of_phase == 0, known)
        row["single_percent"] = _percent((of_phase == 1) | (of_phase == 2), known)
        row["double_percent"] = _percent(of_phase == 3, known)
        row["marker_cm"] = 100 * _rms(marker[inside & used])
        row["linear_bw"] = _rms(np.linalg.norm(force[inside & used], axis=1))
        row["angular_bwh"] = _rms(np.linalg.norm(moment[inside & used], axis=1))


def _percent(has: Bool[np.ndarray, " rows"], known: Bool[np.ndarray, " rows"]) -> float:
    return 100 * float(has[known].mean()) if known.any() else np.nan


def _rms(values: Float[np.ndarray, " rows"]) -> float:
    values = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(values**2))) if len(values) else np.nan


def _points(
    table: pa.Table,
    chosen: Bool[np.ndarray, " rows"],
    subject: Mapping[str, Any],
    trial_id: str,
    centres: pa.Table,
) -> Rows:
    """Every 20th frame of the trial, if it is chosen."""
    frame = column(table, "frame").astype(int)
    rows = np.flatnonzero(chosen & (frame % EVERY == 0))
    if not len(rows):
        return []
    few = table.take(pa.array(rows))
    right, left = (column(few, f"grf_{side}_y_N") for side in "rl")
    both = right + left
    share = np.divide(right, both, out=np.full(len(rows), np.nan), where=both > LOADED_N)
    names = [f"{prefix}_{name}" for prefix in ("q", "tau") for name in COORDINATE_NAMES]
    coordinates = {name: column(few, name) for name in names}
    labels = few["activity"].to_pylist()
    distances = _distances(centres, trial_id)
    return [
        {
            "trial_id": trial_id,
            "frame": int(frame[row]),
            "activity": CLASSES.get(labels[k], UNLABELLED),
            "right_share": float(share[k]),
            "load_N_kg": float(both[k] / subject["mass_kg"]),
            **{name: float(values[k]) for name, values in coordinates.items()},
            **{f"distance_{joint}_m": far[int(frame[row])] for joint, far in distances.items()},
        }
        for k, row in enumerate(rows)
    ]


def _distances(centres: pa.Table, trial_id: str) -> dict[str, dict[int, float]]:
    """By joint and frame, from the root body's origin [m]."""
    part = centres.filter(pc.equal(centres["trial_id"], trial_id))
    frame = column(part, "frame").astype(int)
    part = part.filter(pa.array(frame % EVERY == 0))
    far = np.linalg.norm(vector(part, "root_{}_m"), axis=1)
    found: dict[str, dict[int, float]] = {}
    for joint, at, metres in zip(part["joint"].to_pylist(), column(part, "frame"), far, strict=True):
        found.setdefault(joint, {})[int(at)] = float(metres)
    return found


def _thinned(points: Rows, rng: np.random.Generator) -> Rows:
    """So many at most, by lot; each keeps its lot, so that all have the same chance."""
    for point in points:
        point.setdefault("lot", rng.random())
    if len(points) <= MOST_POINTS:
        return points
    last = sorted(point["lot"] for point in points)[MOST_POINTS - 1]
    return [point for point in points if point["lot"] <= last]


def _alike(points: Rows) -> Rows:
    """With the same columns in all: models have other joints."""
    joints = sorted({name for point in points for name in point if name.startswith("distance_")})
    for point in points:
        del point["lot"]
        point.update({name: point.pop(name, np.nan) for name in joints})
    return points


LINEAR_BW, ANGULAR_BWH = 0.05, 0.1  # thresholds of the dataset paper's table 2
HICKS_BWH = 0.01  # of Hicks et al. 2015, who share the limit of 0.05 body weights
ACTIVITY_CLASSES = tuple(dict.fromkeys(CLASSES.values()))


def sources(found: Gathered) -> Rows:
    """Persons and hours of each source, the sum last. GRF hours are of the chosen frames."""
    rows = []
    source_of = {s["subject_id"]: s["source"] for s in found.subjects}
    for source in sorted({s["source"] for s in found.subjects}):
        persons = {s["person_id"] for s in found.subjects if s["source"] == source}
        trials = [t for t in found.trials if source_of[t["subject_id"]] == source]
        grf = sum(h for (of, _), h in found.hours.items() if of == source)
        hours = sum(t["frames"] * step_s(t) / 3600 for t in trials)
        rows.append(_source(source, len(persons), hours, grf))
    total = [sum(row[name] for row in rows) for name in ("subjects", "total_hours", "grf_hours")]
    return [*rows, _source("Sum", *total)]


def _source(name: str, persons: float, total: float, grf: float) -> dict[str, Any]:
    return {"source": name, "subjects": int(persons), "total_hours": total, "grf_hours": grf}


def activity(found: Gathered) -> Rows:
    """Hours of each class; a row for frames without a label where there are any."""
    rows = []
    for name in (*ACTIVITY_CLASSES, UNLABELLED):
        hours = sum(h for (_, of), h in found.hours.items() if of == name)
        if hours or name != UNLABELLED:
            rows.append({"activity": name, "hours": hours})
    return rows


def segments(found: Gathered) -> Rows:
    """A row a segment: its speed, its length, phases and quality."""
    trials = {t["trial_id"]: t for t in found.trials}
    names = ("flight_percent", "single_percent", "double_percent", "marker_cm", "linear_bw", "angular_bwh")
    return [
        {
            "segment_id": s["segment_id"],
            "activity": CLASSES.get(trials[s["trial_id"]]["activity"], UNLABELLED),
            "speed_m_s": s["average_speed_m_s"],
            "frames": s.get("rows", 0),
            "frames_with_force": s.get("chosen", 0),
            "frames_with_dynamics": s.get("used", 0) if trials[s["trial_id"]]["has_dynamics"] else 0,
            "hours_with_force": s.get("chosen", 0) * step_s(trials[s["trial_id"]]) / 3600,
            **{name: s.get(name, np.nan) for name in names},
        }
        for s in sorted(found.segments, key=lambda s: (s["trial_id"], s["segment"]))
    ]


def contact(rows: Rows) -> Rows:
    """Shares of support over all chosen frames of segments [%].

    Args:
        rows: of `segments`.
    """
    counted = [r for r in rows if r["frames_with_force"] and np.isfinite(r["flight_percent"])]
    weights = [r["frames_with_force"] for r in counted]
    return [
        {
            "support": words,
            "percent_of_frames": _mean([r[f"{name}_percent"] for r in counted], weights),
            "percent_of_segments_mean": _mean([r[f"{name}_percent"] for r in counted]),
        }
        for name, words in (("single", "single support"), ("double", "double support"), ("flight", "flight"))
    ]


def persons(found: Gathered) -> Rows:
    """A row a person; `in_figures` where some of their frames are in the figures."""
    shown = {t["subject_id"] for t in found.trials}
    chosen = {s["subject_id"] for s in found.segments if s.get("chosen", 0)}
    rows: dict[str, dict[str, Any]] = {}
    for s in sorted(found.subjects, key=lambda s: str(s["subject_id"])):
        if s["subject_id"] not in shown:
            continue
        row = rows.setdefault(
            s["person_id"],
            {
                "person_id": s["person_id"],
                "source": s["source"],
                "sex": s["sex"] or "unknown",
                "age_years": s["age_years"],
                "bmi": s["bmi"],
                "in_figures": False,
            },
        )
        row["in_figures"] = row["in_figures"] or s["subject_id"] in chosen
    return list(rows.values())


def demographics(rows: Rows) -> Rows:
    """Age and BMI by sex, of all persons and of those in the figures.

    Args:
        rows: of `persons`.
    """
    told = []
    for group, members in (("all", rows), ("in figures", [r for r in rows if r["in_figures"]])):
        for sex in ("all", "female", "male", "unknown"):
            of_sex = [r for r in members if sex in ("all", r["sex"])]
            row: dict[str, Any] = {"persons": group, "sex": sex, "n": len(of_sex)}
            row["percent"] = 100 * len(of_sex) / len(members) if members else np.nan
            for name in ("age_years", "bmi"):
                known = [float(r[name]) for r in of_sex if r[name] is not None]
                row |= {f"{name}_{what}": of(known) if known else np.nan for what, of in _SUMMARIES.items()}
                row[f"{name}_unknown"] = len(of_sex) - len(known)
            told.append(row)
    return told


def _sd(values: Sequence[float]) -> float:
    return float(np.std(values, ddof=1)) if len(values) > 1 else np.nan


_SUMMARIES: dict[str, Callable[[Sequence[float]], float]] = {
    "mean": lambda v: float(np.mean(v)),
    "sd": _sd,
    "min": min,
    "median": lambda v: float(np.median(v)),
    "max": max,
}


def quality(rows: Rows) -> Rows:
    """Mean and standard deviation over segments of their RMS errors; plain, and weighted by frames.

    Args:
        rows: of `segments`.
    """
    told = []
    for name, limit in (("marker_cm", np.nan), ("linear_bw", LINEAR_BW), ("angular_bwh", ANGULAR_BWH)):
        known = [r for r in rows if np.isfinite(r[name])]
        values, weights = [r[name] for r in known], [r["frames_with_dynamics"] for r in known]
        mean = _mean(values, weights)
        told.append(
            {
                "figure": name,
                "n": len(known),
                "mean": _mean(values),
                "sd": _sd(values),
                "mean_by_frames": mean,
                "sd_by_frames": _mean([(v - mean) ** 2 for v in values], weights) ** 0.5,
                "limit": limit,
            }
        )
    return told


def clinical(rows: Rows, grf_hours: float) -> Rows:
    """Hours of segments within both limits, and what they are of the hours with forces.

    Args:
        rows: of `segments`.
        grf_hours: of all chosen frames: the denominator.
    """
    told = []
    for limits, linear, angular in (("paper", LINEAR_BW, ANGULAR_BWH), ("Hicks", LINEAR_BW, HICKS_BWH)):
        inside = [r for r in rows if r["linear_bw"] <= linear and r["angular_bwh"] <= angular]
        hours = sum(r["hours_with_force"] for r in inside)
        told.append(
            {
                "limits": limits,
                "linear_bw": linear,
                "angular_bwh": angular,
                "segments": len(inside),
                "hours": hours,
                "percent_of_grf_hours": 100 * hours / grf_hours if grf_hours else np.nan,
            }
        )
    return told


def _mean(values: Iterable[float], weights: Sequence[float] | None = None) -> float:
    listed = list(values)
    if not listed or (weights is not None and not sum(weights)):
        return float("nan")
    return float(np.average(listed, weights=weights))
