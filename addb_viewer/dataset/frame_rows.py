"""A trial's rows of the tables that have a file a subject."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
from jaxtyping import Float, Int

from addb_viewer.dataset.columns import COORDINATE_NAMES, Table
from addb_viewer.dataset.grid import Cuts
from addb_viewer.dataset.gridded_trial import GriddedTrial
from addb_viewer.dataset.ground_forces import free_moments, pressing
from addb_viewer.dataset.identifiers import labels_without_names
from addb_viewer.dataset.parquet_files import Values, repeated, table_of
from addb_viewer.dataset.release_tables import FRAMES, JOINT_CENTRES, KINEMATICS, MARKERS, PLATES
from solver.capture.formats.b3d.b3d_fields import PassFrames, SensorFrames
from solver.common.frames_at_once import FRAMES_AT_ONCE, by_frames
from solver.export.b3d.pass_frames import joints_in_order
from solver.fitting.settings import Settings
from solver.kinematics.marker_matching import MarkerMatch
from solver.kinematics.motion import Motion
from solver.kinematics.root_joint import root_joint
from solver.skeleton.forward import body_poses
from solver.skeleton.rotations import quaternions
from solver.skeleton.skeleton import Skeleton

AXES = "xyz"


@dataclass(frozen=True)
class TrialRows:
    """What the tables of a trial are made from."""

    subject_id: str
    trial_id: str
    gridded: GriddedTrial
    cuts: Cuts
    skeleton: Skeleton
    settings: Settings
    first_pass: PassFrames  # K, of all the trial's frames
    last_pass: PassFrames  # likewise D
    sides: Sequence[str]  # of each foot, "r" or "l"
    activity: Sequence[str]  # of each frame
    activity_sub: Sequence[str | None]
    activity_by: Sequence[str]

    @property
    def kept(self) -> Int[np.ndarray, " rows"]:
        """Frames that are in a segment."""
        return np.flatnonzero(self.cuts.number(self.gridded.grid.frames) >= 0)

    def keys(self) -> dict[str, Values]:
        """The columns that all tables with a row a frame begin with."""
        grid, kept = self.gridded.grid, self.kept
        return {
            "subject_id": self.subject_id,
            "trial_id": self.trial_id,
            "segment": self.cuts.number(grid.frames)[kept],
            "frame": kept,
            "time_s": grid.times[kept],
        }


def frames_table(rows: TrialRows) -> pa.Table:
    """Rows of `frames`."""
    kept = rows.kept
    columns = _labels(rows) | _motion(rows) | _body(rows) | _feet(rows) | _residuals(rows)
    errors = rows.gridded.trial.marker_errors
    columns |= {"marker_rms_m": errors.rms_per_frame, "marker_max_m": errors.maximum_per_frame}
    cut = columns
    if len(kept) < rows.gridded.grid.frames:
        cut = {
            name: [values[k] for k in kept] if isinstance(values, list) else values[kept]
            for name, values in columns.items()
        }
    kind = "D" if rows.gridded.trial.kinematics_only else "F"
    return table_of(FRAMES, rows.keys() | {"pass": kind} | cut, len(kept))


def kinematics_table(rows: TrialRows) -> pa.Table:
    """Rows of `kinematics`: pass K."""
    trial = rows.gridded.trial
    motion = trial.kinematics_only.motion if trial.kinematics_only else trial.motion
    columns = {name: values[rows.kept] for name, values in _coordinates("q", motion, motion.q).items()}
    return table_of(KINEMATICS, rows.keys() | columns, len(rows.kept))


def _coordinates(prefix: str, motion: Motion, values: Float[np.ndarray, "frames dofs"]) -> dict[str, Values]:
    """A column for each coordinate that has one, and the others together."""
    columns: dict[str, Values] = {
        f"{prefix}_{name}": values[:, motion.dofs.index(name)]
        for name in COORDINATE_NAMES
        if name in motion.dofs
    }
    others = [k for k, name in enumerate(motion.dofs) if name not in COORDINATE_NAMES]
    return columns | {f"{prefix}_other": values[:, others]}


def _vector(pattern: str, values: Float[np.ndarray, "frames 3"], axes: str = AXES) -> dict[str, Values]:
    return {pattern.format(axis): values[:, k] for k, axis in enumerate(axes)}


def _labels(rows: TrialRows) -> dict[str, Values]:
    gridded, verdicts, trial = rows.gridded, rows.gridded.verdicts, rows.gridded.trial
    assert trial.dynamics is not None
    assert trial.contacts is not None
    predicted = trial.dynamics.wrench_is_predicted
    on_plate = {side: trial.contacts.in_contact[:, f] for f, side in enumerate(rows.sides)}
    on_ground = {side: np.zeros(gridded.grid.frames, dtype=bool) for side in rows.sides}
    for phase in gridded.phases:
        on_ground[rows.sides[phase.foot]][phase.start : phase.end] = True
    phase_number = on_plate["r"].astype(np.int8) + 2 * on_plate["l"].astype(np.int8)
    counts = {side: verdicts.counts_by_foot[:, f] for f, side in enumerate(rows.sides)}
    none = np.zeros(gridded.grid.frames, dtype=bool)
    return {
        "activity": list(rows.activity),
        "activity_sub": list(rows.activity_sub),
        "activity_by": list(rows.activity_by),
        "counts": verdicts.counts,
        "counts_r": counts["r"],
        "counts_l": counts["l"],
        "detected_ok": verdicts.detected_ok,
        "reviewed": verdicts.reviewed,
        "used": trial.dynamics.used,
        "torque_predicted": none if predicted is None else np.any(predicted, axis=1),
        "missing_reason": list(verdicts.missing_reason),
        "missing_number": verdicts.missing_number,
        "phase": np.ma.MaskedArray(phase_number, mask=~verdicts.counts),
        "contact_r": on_ground["r"],
        "contact_l": on_ground["l"],
    }


def _motion(rows: TrialRows) -> dict[str, Values]:
    dynamics = rows.gridded.trial.dynamics
    assert dynamics is not None
    motion = dynamics.motion.without_derivatives()
    return (
        _coordinates("q", motion, motion.q)
        | _coordinates("qd", motion, motion.velocity)
        | _coordinates("qdd", motion, motion.acceleration)
        | _coordinates("tau", motion, dynamics.joint_torques)
    )


def _body(rows: TrialRows) -> dict[str, Values]:
    skeleton, last = rows.skeleton, rows.last_pass
    dynamics = rows.gridded.trial.dynamics
    assert dynamics is not None
    R, p = _poses_of(root_joint(skeleton).body, skeleton, dynamics.motion)
    turned = quaternions(R, canonical=True, scalar_first=True)
    return (
        _vector("com_{}_m", np.asarray(last.com_pos))
        | _vector("com_v_{}_m_s", np.asarray(last.com_vel))
        | _vector("com_a_{}_m_s2", np.asarray(last.com_acc) + skeleton.gravity)
        | _vector("pelvis_{}_m", p)
        | _vector("pelvis_q{}", turned, "wxyz")
    )


def _feet(rows: TrialRows) -> dict[str, Values]:
    trial, surfaces = rows.gridded.trial, rows.gridded.surfaces
    contacts, dynamics = trial.contacts, trial.dynamics
    assert contacts is not None
    assert dynamics is not None
    free = free_moments(contacts, surfaces)
    loaded = pressing(contacts, surfaces) >= rows.settings.conditioning.threshold_N
    columns: dict[str, Values] = {}
    for f, side in enumerate(rows.sides):
        body = rows.skeleton.body_index(contacts.foot_bodies[f])
        _, origin = _poses_of(body, rows.skeleton, dynamics.motion)
        force, moment = contacts.wrench_ground[:, f, :3], contacts.wrench_ground[:, f, 3:]
        counts = rows.gridded.verdicts.counts_by_foot[:, f]
        presses = counts & loaded[:, f]
        about_foot = moment - np.cross(origin, force)
        columns |= _vector(f"grf_{side}_{{}}_N", _where(counts, force))
        columns |= _vector(f"grm_{side}_{{}}_Nm", _where(counts, about_foot))
        columns |= _vector(f"foot_{side}_{{}}_m", origin)
        columns |= _vector(f"cop_{side}_{{}}_m", _where(presses, contacts.cop_ground[:, f]))
        columns[f"free_moment_{side}_Nm"] = _where(presses, free[:, f, None])[:, 0]
    return columns


def _residuals(rows: TrialRows) -> dict[str, Values]:
    dynamics, counts = rows.gridded.trial.dynamics, rows.gridded.verdicts.counts
    assert dynamics is not None
    columns: dict[str, Values] = {}
    for name, wrench in (
        ("residual", _where(counts, dynamics.residual_root)),
        ("residual_raw", _where(counts, dynamics.residual_raw_root)),
        ("extra", rows.gridded.extra_root),
    ):
        columns |= _vector(f"{name}_force_{{}}_N", wrench[:, :3])
        columns |= _vector(f"{name}_moment_{{}}_Nm", wrench[:, 3:])
    return columns | _vector("root_joint_{}_m", dynamics.root_ground)


def _poses_of(
    body: int, skeleton: Skeleton, motion: Motion
) -> tuple[Float[np.ndarray, "frames 3 3"], Float[np.ndarray, "frames 3"]]:
    """Orientation and origin [m] of one body."""

    def of_frames(q: Float[np.ndarray, "some dofs"]) -> Float[np.ndarray, "some 4 3"]:
        R, p = body_poses(skeleton, q)
        return np.concatenate([R[:, body], p[:, body, None]], axis=1)

    both = by_frames(of_frames, motion.q)
    return both[:, :3], both[:, 3]


def _where(known: np.ndarray, values: Float[np.ndarray, "frames n"]) -> Float[np.ndarray, "frames n"]:
    return np.where(known[:, None], values, np.nan)


def markers_tables(rows: TrialRows, match: MarkerMatch) -> Iterator[pa.Table]:
    """Rows of `markers`: each label where it was seen, and where the skeleton has that marker."""
    trial = rows.gridded.trial
    recorded = trial.capture.markers
    modelled = np.full(recorded.positions_ground.shape, np.nan)
    for k, column in enumerate(match.columns(recorded)):
        if column is not None:
            modelled[:, column] = trial.model_markers_ground[:, k]
    yield from _long(
        rows,
        MARKERS,
        labels_without_names(recorded.names),
        {"measured_{}_m": recorded.positions_ground, "modelled_{}_m": modelled},
    )


def joint_centres_tables(rows: TrialRows) -> Iterator[pa.Table]:
    """Rows of `joint_centres`."""
    last, frames = rows.last_pass, rows.gridded.grid.frames
    names = [rows.skeleton.joints[joint].name for joint in joints_in_order(rows.skeleton)]
    in_root = np.asarray(last.root_frame_joint_centers).reshape(frames, -1, 3)
    in_ground = np.asarray(last.world_frame_joint_centers).reshape(frames, -1, 3)
    yield from _long(rows, JOINT_CENTRES, names, {"root_{}_m": in_root, "ground_{}_m": in_ground})


def plates_tables(rows: TrialRows, sensors: SensorFrames) -> Iterator[pa.Table]:
    """Rows of `plates`, raw; those that the subject's other trials have and this one lacks are not here."""
    frames, plates = rows.gridded.grid.frames, rows.gridded.trial.capture.plates
    shape = (frames, -1, 3)
    force = np.asarray(sensors.raw_force_plate_force).reshape(shape)[:, : len(plates)]
    moment = np.asarray(sensors.raw_force_plate_torque).reshape(shape)[:, : len(plates)]
    cop = np.asarray(sensors.raw_force_plate_cop).reshape(shape)[:, : len(plates)]
    unloaded = (cop == 0.0).all(axis=2, keepdims=True)  # as B3D writes it
    yield from _long(
        rows,
        PLATES,
        labels_without_names([plate.name for plate in plates]),
        {"force_{}_N": force, "moment_{}_Nm": moment, "cop_{}_m": np.where(unloaded, np.nan, cop)},
    )


def _long(
    rows: TrialRows,
    table: Table,
    names: Sequence[str],
    values: dict[str, Float[np.ndarray, "frames names 3"]],
) -> Iterator[pa.Table]:
    """Sorted by name, then frame."""
    kept, order = rows.kept, sorted(range(len(names)), key=lambda k: names[k])
    own = next(column.name for column in table.columns if column.name not in ("subject_id", "trial_id"))
    parts = [order] if rows.gridded.grid.frames <= FRAMES_AT_ONCE else [[k] for k in order]
    for some in parts or [[]]:
        columns = {
            pattern.format(axis): series[:, some, a][kept].T.reshape(-1)
            for pattern, series in values.items()
            for a, axis in enumerate(AXES)
        }
        keys = {
            "subject_id": rows.subject_id,
            "trial_id": rows.trial_id,
            own: repeated([names[k] for k in some], len(kept)),
            "frame": np.tile(kept, len(some)),
        }
        yield table_of(table, keys | columns, len(some) * len(kept))
