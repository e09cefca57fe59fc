"""A trial's rows of the long tables: a row a marker, joint or plate, and frame.

Those of a long trial come name by name.
"""

from collections.abc import Iterator, Sequence

import numpy as np
import pyarrow as pa
from jaxtyping import Float

from addb_viewer.dataset.arrow_rows import repeated, table_of
from addb_viewer.dataset.frame_rows import AXES, TrialRows
from addb_viewer.dataset.identifiers import labels_without_names
from addb_viewer.dataset.schema import JOINT_CENTRES, MARKERS, PLATES
from addb_viewer.dataset.table import Table
from solver.capture.formats.b3d.schema import SensorFrames
from solver.common.frames_at_once import FRAMES_AT_ONCE
from solver.export.b3d.model import joints_in_order
from solver.kinematics.marker_matching import MarkerMatch


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
