"""Findings in the numbers of a subject and a trial: F = ma, torques, what bodies do not do, copies."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from jaxtyping import Bool, Float

from addb_viewer.dataset.columns import COORDINATE_NAMES, TRANSLATIONS
from addb_viewer.dataset.reader import column, coordinate_values, marker_places, vector
from addb_viewer.dataset.same_recording import Places, Recording, recording_of
from solver.common.true_runs import runs


class Level(StrEnum):
    """How bad it is."""

    ERROR = "error"  # the release must not go out
    WARNING = "warning"  # a person should look


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong, or looks so."""

    level: Level
    check: str  # files, schema, forces, torques, plausible, duplicates, splits, b3d, labels, against
    where: str  # file, subject or trial
    said: str

    def __str__(self) -> str:
        return f"{self.level}: {self.where}: {self.said} [{self.check}]"


error = partial(Finding, Level.ERROR)
warning = partial(Finding, Level.WARNING)

GRAVITY = np.array([0.0, -9.80665, 0.0])  # [m/s²]
FORCE_N, FORCE_SHARE = 0.1, 1e-4  # of the balance: a constant, and a share of the weight
COM_M = 1e-4
MOMENT_NM, MOMENT_SHARE_M = 0.1, 1e-4  # of the balance of moments; the share is of the weight, times 1 m
TORQUE_NM, TORQUE_SHARE = 0.02, 1e-4  # of tau; the share is of its own size
MOST_FRAMES = 400  # of a trial, whose torques are computed anew


def force_findings(frames: pa.Table, subject: Mapping[str, Any]) -> Iterator[Finding]:
    """M (a − g) − Σ forces − what causes add = residual force, on every frame that counts.

    Args:
        frames: of one trial.
        subject: its row.
    """
    counts: Bool[np.ndarray, " rows"] = column(frames, "counts") > 0
    if not counts.any():
        return
    mass = float(subject["mass_kg"])
    required = mass * (vector(frames, "com_a_{}_m_s2") - GRAVITY)
    given = sum(vector(frames, f"grf_{side}_{{}}_N") for side in "rl") + vector(frames, "extra_force_{}_N")
    off = np.linalg.norm(required - given - vector(frames, "residual_force_{}_N"), axis=1)
    limit = FORCE_N + FORCE_SHARE * mass * 9.80665
    bad = counts & ~(off <= limit)
    if bad.any():
        trial, frame = _first(frames, bad)
        by = f"off by up to {np.nanmax(off[bad]):.2f} N, the first is frame {frame}"
        yield error("forces", trial, f"F = ma does not hold on {bad.sum()} frames: {by}")


def torque_findings(
    frames: pa.Table, subject: Mapping[str, Any], model: Path, coordinates: list[dict[str, Any]]
) -> Iterator[Finding]:
    """The centre of mass, residual moment and tau, anew from q, its derivatives, the forces and the model.

    Args:
        frames: of one trial.
        subject: its row.
        model: its OpenSim file in the release.
        coordinates: rows of the table, of the subject.
    """
    from solver.common.errors import ModelError  # noqa: PLC0415
    from solver.simulate.ground_demand import GroundDemand  # noqa: PLC0415
    from solver.skeleton.osim import load_skeleton  # noqa: PLC0415
    from solver.skeleton.pinocchio_model import RigidBodyModel  # noqa: PLC0415

    trial = str(frames["trial_id"][0])
    try:
        skeleton = load_skeleton(model)
    except (ModelError, OSError) as unreadable:
        yield error("torques", str(subject["subject_id"]), f"{model.name} cannot be read ({unreadable})")
        return
    few = frames.take(
        pa.array(np.linspace(0, frames.num_rows - 1, min(frames.num_rows, MOST_FRAMES)).astype(int))
    )
    places = {row["name"]: row["place"] for row in coordinates if row["list"] == "other"}
    lost = [name for name in skeleton.dofs if name not in COORDINATE_NAMES and name not in places]
    if lost:
        yield error("torques", trial, f"no column for the model's coordinate {lost[0]}")
        return
    q, qd, qdd, tau = (
        coordinate_values(few, prefix, skeleton.dofs, places) for prefix in ("q", "qd", "qdd", "tau")
    )
    body = RigidBodyModel(skeleton)
    off = np.linalg.norm(body.centre_of_mass(q) - vector(few, "com_{}_m"), axis=1)
    if not (off <= COM_M).all():
        yield error("torques", trial, f"the centre of mass is {1000 * np.nanmax(off):.2f} mm off the model's")
    feet = [skeleton.body_index(name) for name in subject["contact_bodies"]]
    wrenches = np.stack([_wrench(few, side) for side in "rl"], axis=1)
    required = GroundDemand(body).wrench(q, qd, qdd)
    yield from _moment_findings(few, required, wrenches.sum(axis=1), float(subject["mass_kg"]))
    told = ~(column(few, "torque_predicted") > 0)
    again = body.inverse_dynamics(q, qd, qdd, wrenches, feet)
    error_Nm = np.abs(again - tau) - TORQUE_SHARE * np.abs(tau)
    bad = told & ~(error_Nm.max(axis=1) <= TORQUE_NM)
    if bad.any():
        worst = int(np.nanargmax(np.where(bad, np.nan_to_num(error_Nm, nan=np.inf).max(axis=1), -1)))
        dof = skeleton.dofs[int(np.nanargmax(error_Nm[worst]))]
        yield error(
            "torques",
            trial,
            f"tau differs from the model's on {bad.sum()} of {few.num_rows} frames, most in {dof}",
        )


def _moment_findings(
    frames: pa.Table,
    required: Float[np.ndarray, "rows 6"],
    given: Float[np.ndarray, "rows 6"],
    mass_kg: float,
) -> Iterator[Finding]:
    """What the motion demands less what is given, about the root joint's centre, is the residual moment.

    Args:
        frames: of one trial.
        required: by Newton and Euler for the whole body: force, moment about the ground origin.
        given: by the feet, likewise.
        mass_kg: of the body.
    """
    missing = required - given
    about_root = missing[:, 3:] - np.cross(vector(frames, "root_joint_{}_m"), missing[:, :3])
    stored = vector(frames, "residual_moment_{}_Nm") + vector(frames, "extra_moment_{}_Nm")
    off = np.linalg.norm(about_root - stored, axis=1)
    bad = (column(frames, "counts") > 0) & ~(off <= MOMENT_NM + MOMENT_SHARE_M * mass_kg * 9.80665)
    if bad.any():
        trial, frame = _first(frames, bad)
        by = f"off by up to {np.nanmax(off[bad]):.2f} N·m, the first is frame {frame}"
        yield error("forces", trial, f"the residual moment is another on {bad.sum()} frames: {by}")


def _wrench(frames: pa.Table, side: str) -> Float[np.ndarray, "rows 6"]:
    """Of a foot, about the ground origin; zero where it does not count."""
    force = np.nan_to_num(vector(frames, f"grf_{side}_{{}}_N"))
    moment = np.nan_to_num(vector(frames, f"grm_{side}_{{}}_Nm"))
    return np.concatenate([force, moment + np.cross(vector(frames, f"foot_{side}_{{}}_m"), force)], axis=1)


def _first(frames: pa.Table, bad: Bool[np.ndarray, " rows"]) -> tuple[str, int]:
    row = int(np.flatnonzero(bad)[0])
    return str(frames["trial_id"][row]), int(frames["frame"][row].as_py())


RANGES = {
    "age_years": (2.0, 110.0),
    "height_m": (0.7, 2.3),
    "mass_kg": (8.0, 250.0),
    "bmi": (10.0, 60.0),
}
MASS_SHARE = 0.02  # by which the fitted mass may differ from what plates carry
WORST_MARKERS_M = 0.04  # RMS of a trial; Hicks et al. 2015 ask for 0.02, their largest for 0.04
FASTEST_RAD_S = 50.0  # of a joint; knees of sprinters reach 25
FARTHEST_M = 0.35  # of a centre of pressure from the foot body's origin, which is the heel
LOADED_N = 100.0
FROZEN_S = 0.1  # that a centre of pressure stays the very same under load
STILL_M = 0.005  # that the foot goes meanwhile: a standing person's centre of pressure is never the very same


def subject_findings(subject: Mapping[str, Any]) -> Iterator[Finding]:
    """Age, stature and mass.

    Args:
        subject: its row.
    """
    where = str(subject["subject_id"])
    for name, (low, high) in RANGES.items():
        value = subject[name]
        if value is not None and not low <= value <= high:
            yield warning("plausible", where, f"{name} is {value:g}, expected {low:g} to {high:g}")
    carried = subject["mass_from_forces_kg"]
    if carried is not None and abs(subject["mass_kg"] / carried - 1) > MASS_SHARE:
        yield warning(
            "plausible",
            where,
            f"its mass is {subject['mass_kg']:.1f} kg, the plates carry {carried:.1f} kg",
        )


def frame_findings(frames: pa.Table) -> Iterator[Finding]:
    """Markers, speeds of joints, and what feet and plates say of each other.

    Args:
        frames: of one trial.
    """
    trial = str(frames["trial_id"][0])
    off = column(frames, "marker_rms_m")
    off = off[np.isfinite(off)]
    if len(off) and (rms := float(np.sqrt(np.mean(off**2)))) > WORST_MARKERS_M:
        yield warning("plausible", trial, f"markers are {100 * rms:.1f} cm off the skeleton, RMS")
    for name in COORDINATE_NAMES:
        speed = np.abs(column(frames, f"qd_{name}"))
        if name not in TRANSLATIONS and (speed > FASTEST_RAD_S).any():
            yield warning("plausible", trial, f"{name} turns at {np.nanmax(speed):.0f} rad/s")
    for side, words in (("r", "right"), ("l", "left")):
        yield from _foot_findings(frames, side, f"the {words} foot", trial)


def _foot_findings(frames: pa.Table, side: str, foot: str, trial: str) -> Iterator[Finding]:
    force = vector(frames, f"grf_{side}_{{}}_N")
    cop, origin = vector(frames, f"cop_{side}_{{}}_m"), vector(frames, f"foot_{side}_{{}}_m")
    loaded = np.nan_to_num(force[:, 1]) > LOADED_N
    away = np.linalg.norm((cop - origin)[:, [0, 2]], axis=1)
    far = loaded & (away > FARTHEST_M)
    if far.any():
        yield warning(
            "plausible",
            trial,
            f"the centre of pressure of {foot} is up to {np.nanmax(away[far]):.2f} m from its heel "
            f"on {far.sum()} frames",
        )
    rate = _rate(frames)
    for start, end in _frozen(cop, loaded, round(FROZEN_S * rate)):
        if np.linalg.norm(np.ptp(origin[start:end], axis=0)) > STILL_M:
            frame = frames["frame"][start].as_py()
            yield warning(
                "plausible", trial, f"the centre of pressure of {foot} stands still from frame {frame} on"
            )
            break
    for end, before, words in ((0, 1, "first"), (-1, -2, "last")):
        if frames.num_rows > 1 and not force[end].any() and loaded[before]:
            said = f"the force of {foot} is zero on the {words} frame, beside a loaded one"
            yield warning("plausible", trial, said)


def _frozen(
    cop: Float[np.ndarray, "rows 3"], loaded: Bool[np.ndarray, " rows"], least: int
) -> list[tuple[int, int]]:
    """Ranges of rows on which a loaded centre of pressure is the very same."""
    same = np.zeros(len(cop), dtype=bool)
    same[1:] = (np.diff(cop, axis=0) == 0).all(axis=1) & loaded[1:] & loaded[:-1]
    return [(start - 1, end) for start, end in runs(same) if end - start + 1 > least]


def _rate(frames: pa.Table) -> float:
    times = column(frames, "time_s")
    return float(1 / np.median(np.diff(times))) if len(times) > 1 else 1.0


Pair = tuple[Recording, Recording]
MARKER_COLUMNS = ["trial_id", "marker", "frame", *(f"measured_{axis}_m" for axis in "xyz")]


def recording_in(trial_id: str, kinematics: pa.Table, markers: pa.Table, file: Path) -> Recording | None:
    """A trial of a release as it is compared; None without frames or markers.

    Args:
        trial_id: of the trial.
        kinematics: its rows of that table.
        markers: likewise.
        file: that holds the markers' rows, to read them again.
    """
    if not kinematics.num_rows or not markers.num_rows:
        return None
    frame, times = column(kinematics, "frame").astype(int), column(kinematics, "time_s")
    labels = tuple(sorted(set(markers["marker"].to_pylist())))

    def places(rows: pa.Table) -> Places:
        return Places(times - times[0], marker_places(rows, frame, labels))

    def again() -> Places:
        return places(pq.read_table(file, columns=MARKER_COLUMNS, filters=[("trial_id", "=", trial_id)]))

    return recording_of(trial_id, labels, places(markers), again)


def duplicate_findings(pairs: Iterable[Pair], persons: Mapping[str, str]) -> Iterator[Finding]:
    """Every pair of trials that show the same recording.

    Args:
        pairs: of such trials.
        persons: by trial_id.
    """
    for one, other in pairs:
        same = persons[one.trial_id] == persons[other.trial_id]
        whose = "" if same else f", and they are called two persons ({persons[one.trial_id]} and another)"
        yield error("duplicates", one.trial_id, f"{copy_words(one, other)}{whose}")


def copy_words(one: Recording, other: Recording) -> str:
    """How a trial goes with another that shows the same.

    Args:
        one: of the pair.
        other: likewise.
    """
    kind = "the same recording as" if one.digest == other.digest else "a copy of a part of"
    return f"is {kind} {other.trial_id}"
