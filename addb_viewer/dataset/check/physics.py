"""F = ma and the torques, from the files of a release alone."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from jaxtyping import Bool, Float

from addb_viewer.dataset.check.finding import Finding, error
from addb_viewer.dataset.frame_columns import COORDINATE_NAMES

GRAVITY = np.array([0.0, -9.80665, 0.0])  # [m/s²]
FORCE_N, FORCE_SHARE = 0.1, 1e-4  # of the balance: a constant, and a share of the weight
COM_M = 1e-4
MOMENT_NM, MOMENT_SHARE_M = 0.1, 1e-4  # of the balance of moments; the share is of the weight, times 1 m
TORQUE_NM, TORQUE_SHARE = 0.02, 1e-4  # of tau; the share is of its own size
MOST_FRAMES = 400  # of a trial, whose torques are computed anew


def vector(table: pa.Table, pattern: str) -> Float[np.ndarray, "rows 3"]:
    """Three columns; NaN where they are null.

    Args:
        table: that has them.
        pattern: of their names; `{}` is the axis.
    """
    return np.column_stack([column(table, pattern.format(axis)) for axis in "xyz"])


def column(table: pa.Table, name: str) -> Float[np.ndarray, " rows"]:
    """One column of numbers; NaN where it is null.

    Args:
        table: that has it.
        name: of the column.
    """
    return np.asarray(pc.fill_null(table[name].cast(pa.float64()), np.nan).to_numpy(), dtype=float)


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
    q, qd, qdd, tau = (_values(few, prefix, skeleton.dofs, places) for prefix in ("q", "qd", "qdd", "tau"))
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


def _values(
    frames: pa.Table, prefix: str, dofs: tuple[str, ...], places: Mapping[str, int]
) -> Float[np.ndarray, "rows dofs"]:
    others = np.array([row or [] for row in frames[f"{prefix}_other"].to_pylist()], dtype=float)
    return np.column_stack(
        [
            column(frames, f"{prefix}_{name}") if name in COORDINATE_NAMES else others[:, places[name]]
            for name in dofs
        ]
    )


def _wrench(frames: pa.Table, side: str) -> Float[np.ndarray, "rows 6"]:
    """Of a foot, about the ground origin; zero where it does not count."""
    force = np.nan_to_num(vector(frames, f"grf_{side}_{{}}_N"))
    moment = np.nan_to_num(vector(frames, f"grm_{side}_{{}}_Nm"))
    return np.concatenate([force, moment + np.cross(vector(frames, f"foot_{side}_{{}}_m"), force)], axis=1)


def _first(frames: pa.Table, bad: Bool[np.ndarray, " rows"]) -> tuple[str, int]:
    row = int(np.flatnonzero(bad)[0])
    return str(frames["trial_id"][row]), int(frames["frame"][row].as_py())
