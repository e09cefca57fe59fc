"""The numbers of every table and figure, as rows with named columns: what the CSV files hold."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from addb_viewer.dataset.frame_columns import COORDINATE_NAMES
from addb_viewer.dataset.stats.gathering import CLASSES, UNLABELLED, Gathered, step_s

Rows = list[dict[str, Any]]

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
        grf = sum(hours for (of, _), hours in found.hours.items() if of == source)
        rows.append(_source(source, len(persons), sum(map(_hours, trials)), grf))
    total = [sum(row[name] for row in rows) for name in ("subjects", "total_hours", "grf_hours")]
    return [*rows, _source("Sum", *total)]


def _source(name: str, persons: float, total: float, grf: float) -> dict[str, Any]:
    return {"source": name, "subjects": int(persons), "total_hours": total, "grf_hours": grf}


def _hours(trial: Mapping[str, Any]) -> float:
    return int(trial["frames"]) * step_s(trial) / 3600


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


def scatter(found: Gathered) -> Rows:
    """A row a frame of the scatter plots."""
    s = found.sample
    return [
        {
            "trial_id": s.trial_id[k],
            "frame": s.frame[k],
            "activity": s.activity[k],
            "right_share": s.right_share[k],
            "load_N_kg": s.load_N_kg[k],
            **{f"q_{name}": s.angles[k, c] for c, name in enumerate(COORDINATE_NAMES)},
            **{f"tau_{name}": s.moments[k, c] for c, name in enumerate(COORDINATE_NAMES)},
            **{f"distance_{joint}_m": s.distances[k, j] for j, joint in enumerate(s.joints)},
        }
        for k in range(len(s.trial_id))
    ]


def _mean(values: Iterable[float], weights: Sequence[float] | None = None) -> float:
    listed = list(values)
    if not listed or (weights is not None and not sum(weights)):
        return float("nan")
    return float(np.average(listed, weights=weights))
