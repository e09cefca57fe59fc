"""One pass over a release's frames: what each segment holds, and a sample of frames for the scatter plots."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
from jaxtyping import Bool, Float

from addb_viewer.dataset.errors import ReleaseError
from addb_viewer.dataset.frame_columns import COORDINATE_NAMES

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


class Frames(StrEnum):
    """Which frames a figure is about; of all of them, every force counts."""

    PAPER = "paper"  # reviewed, and detection finds no fault by itself either
    REVIEWED = "reviewed"  # of trials that a person has finished
    ALL = "all"


@dataclass(frozen=True)
class Sample:
    """Frames of the scatter plots; one row each."""

    trial_id: tuple[str, ...]
    frame: tuple[int, ...]
    activity: tuple[str, ...]
    right_share: Float[np.ndarray, " points"]  # of both feet's vertical force; NaN below 20 N
    load_N_kg: Float[np.ndarray, " points"]  # vertical force over mass
    angles: Float[np.ndarray, "points coordinates"]  # [rad or m]
    moments: Float[np.ndarray, "points coordinates"]  # [N·m or N]
    joints: tuple[str, ...]
    distances: Float[np.ndarray, "points joints"]  # of joint centres from the root body's origin [m]


@dataclass(frozen=True)
class Gathered:
    """What figures are made from."""

    subjects: list[dict[str, Any]]
    trials: list[dict[str, Any]]
    segments: list[dict[str, Any]]  # with the figures of the chosen frames
    hours: dict[tuple[str, str], float]  # of chosen frames, by source and class
    sample: Sample


def gathered(release: Path, frames: Frames) -> Gathered:
    """Read a release once.

    Args:
        release: its folder.
        frames: which of them figures are about.

    Raises:
        ReleaseError: a table is missing or cannot be read.
    """
    subjects = {row["subject_id"]: row for row in rows_of(release, "subjects")}
    trials = {row["trial_id"]: row for row in rows_of(release, "trials")}
    segments = {(r["trial_id"], r["segment"]): r for r in rows_of(release, "segments")}
    hours: dict[tuple[str, str], float] = {}
    points: list[dict[str, Any]] = []
    rng = np.random.default_rng(SEED)
    for file in sorted((release / "frames").glob("*.parquet")):
        table = read_table(release, f"frames/{file.name}")
        centres = read_table(release, f"joint_centres/{file.name}")
        for trial_id, part in _by_trial(table):
            trial = trials[trial_id]
            subject = subjects[trial["subject_id"]]
            chosen = chosen_frames(part, trial, frames)
            _count_hours(part, chosen, step_s(trial), str(subject["source"]), hours)
            _fill_segments(part, chosen, subject, trial_id, segments)
            points += _points(part, chosen, subject, trial_id, centres)
        points = _thinned(points, rng)
    return Gathered(
        list(subjects.values()), list(trials.values()), list(segments.values()), hours, _sample(points)
    )


def chosen_frames(table: pa.Table, trial: Mapping[str, Any], frames: Frames) -> Bool[np.ndarray, " rows"]:
    """Which rows of a trial a figure is about.

    Args:
        table: the trial's rows of `frames`.
        trial: its row of `trials`.
        frames: the choice.
    """
    counts = _array(table, "counts")
    if frames is Frames.ALL:
        return counts
    if not trial["reviewed"]:
        return np.zeros_like(counts)
    return counts if frames is Frames.REVIEWED else counts & _array(table, "detected_ok")


def rows_of(release: Path, name: str) -> list[dict[str, Any]]:
    """The rows of a table of the whole release.

    Raises:
        ReleaseError: it is missing or cannot be read.
    """
    rows: list[dict[str, Any]] = read_table(release, f"{name}.parquet").to_pylist()
    return rows


def read_table(release: Path, path: str) -> pa.Table:
    """A table of a release.

    Raises:
        ReleaseError: it is missing or cannot be read.
    """
    try:
        return pq.read_table(release / path)
    except FileNotFoundError as error:
        raise ReleaseError(f"{release / path}: no such file; give the folder of a release") from error
    except (pa.ArrowInvalid, OSError) as error:
        raise ReleaseError(f"{release / path}: cannot be read as Parquet ({error})") from error


def _by_trial(table: pa.Table) -> Iterator[tuple[str, pa.Table]]:
    """Rows are sorted by trial."""
    ids = np.asarray(table["trial_id"].to_pylist(), dtype=object)
    if not len(ids):
        return
    borders = [0, *(np.flatnonzero(ids[1:] != ids[:-1]) + 1), len(ids)]
    for start, end in pairwise(borders):
        yield str(ids[start]), table.slice(start, end - start)


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
    number, phase = _array(table, "segment"), _array(table, "phase", -1)
    used = chosen & _array(table, "used")
    weight = float(subject["mass_kg"]) * GRAVITY
    force = _vector(table, "residual_force_{}_N") / weight
    moment = _vector(table, "residual_moment_{}_Nm") / (weight * float(subject["height_m"]))
    marker = _array(table, "marker_rms_m", np.nan)
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
) -> list[dict[str, Any]]:
    """Every 20th frame of the trial, if it is chosen."""
    frame = _array(table, "frame")
    rows = np.flatnonzero(chosen & (frame % EVERY == 0))
    if not len(rows):
        return []
    few = table.take(pa.array(rows))
    right, left = (_array(few, f"grf_{side}_y_N", np.nan) for side in "rl")
    both = right + left
    share = np.divide(right, both, out=np.full(len(rows), np.nan), where=both > LOADED_N)
    angles = np.column_stack([_array(few, f"q_{name}", np.nan) for name in COORDINATE_NAMES])
    moments = np.column_stack([_array(few, f"tau_{name}", np.nan) for name in COORDINATE_NAMES])
    labels = few["activity"].to_pylist()
    distances = _distances(centres, trial_id)
    return [
        {
            "trial_id": trial_id,
            "frame": int(frame[row]),
            "activity": CLASSES.get(labels[k], UNLABELLED),
            "share": float(share[k]),
            "load": float(both[k] / subject["mass_kg"]),
            "angles": angles[k],
            "moments": moments[k],
            "distances": {joint: far[int(frame[row])] for joint, far in distances.items()},
        }
        for k, row in enumerate(rows)
    ]


def _distances(centres: pa.Table, trial_id: str) -> dict[str, dict[int, float]]:
    """By joint and frame, from the root body's origin [m]."""
    part = centres.filter(pc.equal(centres["trial_id"], trial_id))
    frame = _array(part, "frame")
    part = part.filter(pa.array(frame % EVERY == 0))
    far = np.linalg.norm(_vector(part, "root_{}_m"), axis=1)
    found: dict[str, dict[int, float]] = {}
    for joint, at, metres in zip(part["joint"].to_pylist(), _array(part, "frame"), far, strict=True):
        found.setdefault(joint, {})[int(at)] = float(metres)
    return found


def _thinned(points: list[dict[str, Any]], rng: np.random.Generator) -> list[dict[str, Any]]:
    """So many at most, by lot; each keeps its lot, so that all have the same chance."""
    for point in points:
        point.setdefault("lot", rng.random())
    if len(points) <= MOST_POINTS:
        return points
    last = sorted(point["lot"] for point in points)[MOST_POINTS - 1]
    return [point for point in points if point["lot"] <= last]


def _sample(points: list[dict[str, Any]]) -> Sample:
    joints = tuple(sorted({joint for point in points for joint in point["distances"]}))
    nothing = np.zeros((0, len(COORDINATE_NAMES)))
    return Sample(
        trial_id=tuple(p["trial_id"] for p in points),
        frame=tuple(p["frame"] for p in points),
        activity=tuple(p["activity"] for p in points),
        right_share=np.array([p["share"] for p in points]),
        load_N_kg=np.array([p["load"] for p in points]),
        angles=np.array([p["angles"] for p in points]) if points else nothing,
        moments=np.array([p["moments"] for p in points]) if points else nothing,
        joints=joints,
        distances=np.array([[p["distances"].get(joint, np.nan) for joint in joints] for p in points]),
    )


def _vector(table: pa.Table, pattern: str) -> Float[np.ndarray, "rows 3"]:
    return np.column_stack([_array(table, pattern.format(axis), np.nan) for axis in "xyz"])


def _array(table: pa.Table, name: str, null: float | None = None) -> np.ndarray:
    """A column; with `null` where it has none."""
    column = table[name].combine_chunks() if isinstance(table[name], pa.ChunkedArray) else table[name]
    if null is not None:
        column = pc.fill_null(column, pa.scalar(null, type=column.type))
    return np.asarray(column.to_numpy(zero_copy_only=False))
