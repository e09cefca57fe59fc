"""Which endings are read and written, by what, and what each of them can hold."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from solver.capture.formats.text_exports import ENDINGS as TEXT_ENDINGS
from solver.export.conversion.b3d import read_b3d_file
from solver.export.conversion.b3d_writing import write_b3d_file
from solver.export.conversion.content import Content, Part
from solver.export.conversion.opensim_set import write_opensim_set
from solver.export.conversion.recordings import (
    read_force_table,
    read_marker_file,
    read_text_export,
    write_c3d_file,
    write_mot,
    write_trc_file,
)
from solver.export.conversion.tables import read_parquet, write_parquet
from solver.export.gltf import moving_skeleton
from solver.export.mujoco import write_mujoco
from solver.skeleton.bones import body_meshes

FOLDER = ""  # the ending of a folder for OpenSim
MEASURED = frozenset({Part.MARKERS, Part.PLATES})
MOVING = frozenset({Part.MODEL, Part.MOTION})


@dataclass(frozen=True)
class Writer:
    """How a format is written: what it needs must be there; what it cannot hold is told."""

    write: Callable[[Content, Path], tuple[str, ...]]  # returns notes
    holds: frozenset[Part]
    needs: frozenset[Part]
    holds_all_trials: bool = False  # else a file is written for each


def write_glb(content: Content, path: Path) -> tuple[str, ...]:
    """Write one trial's moving skeleton as glTF, with the stock bones."""
    (trial,) = content.trials
    assert content.skeleton is not None
    assert trial.motion is not None
    meshes = body_meshes(content.skeleton).meshes
    path.write_bytes(moving_skeleton(content.skeleton, meshes, trial.motion, trial.name))
    return ()


def write_mjcf(content: Content, path: Path) -> tuple[str, ...]:
    """Write the model for MuJoCo, its bones, and a motion file for each trial."""
    assert content.skeleton is not None
    motions = {trial.name: trial.motion for trial in content.trials if trial.motion is not None}
    meshes = body_meshes(content.skeleton).meshes
    return write_mujoco(path, content.skeleton, meshes, motions)[1]


READERS: dict[str, Callable[[Path], Content]] = {
    ".c3d": read_marker_file,
    ".trc": read_marker_file,
    ".mot": read_force_table,
    ".sto": read_force_table,
    **dict.fromkeys(TEXT_ENDINGS, read_text_export),
    ".b3d": read_b3d_file,
    ".parquet": read_parquet,
}
WRITERS = {
    ".c3d": Writer(
        write_c3d_file,
        holds=MEASURED | {Part.EVENTS, Part.MOTION, Part.TORQUES, Part.PERSON},
        needs=frozenset({Part.MARKERS}),
    ),
    ".trc": Writer(write_trc_file, holds=MEASURED, needs=frozenset({Part.MARKERS})),
    ".mot": Writer(write_mot, holds=frozenset({Part.PLATES}), needs=frozenset({Part.PLATES})),
    ".sto": Writer(write_mot, holds=frozenset({Part.PLATES}), needs=frozenset({Part.PLATES})),
    ".parquet": Writer(write_parquet, holds=MEASURED | {Part.MOTION, Part.TORQUES}, needs=frozenset()),
    ".b3d": Writer(
        write_b3d_file,
        holds=frozenset(Part) - {Part.EVENTS},
        needs=frozenset(),
        holds_all_trials=True,
    ),
    ".glb": Writer(write_glb, holds=MOVING, needs=MOVING),
    ".xml": Writer(write_mjcf, holds=MOVING, needs=MOVING, holds_all_trials=True),
    FOLDER: Writer(
        write_opensim_set,
        holds=frozenset(Part) - {Part.EVENTS},
        needs=MOVING,
        holds_all_trials=True,
    ),
}
