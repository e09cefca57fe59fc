"""A folder for OpenSim: a model, and for each trial its motion, forces, markers and joint torques.

    model.osim                  any one .osim file
    TRIAL_ik.mot                coordinates
    TRIAL.trc                   markers
    TRIAL_grf.mot               forces on bodies, with TRIAL_external_loads.xml
    TRIAL_plates.mot            force plates; TRIAL_plates_2.mot those of another clock
    TRIAL_id.sto                joint torques

Of a trial, only the motion must be there.
"""

from collections.abc import Sequence
from glob import escape
from pathlib import Path

import numpy as np
from jaxtyping import Float

from solver.capture.atomic import write_whole
from solver.capture.capture import ForcePlate
from solver.capture.formats.storage import Storage, coordinates_from_storage, read_storage, write_storage
from solver.capture.formats.trc import read_trc, write_trc
from solver.capture.plates.moment_convention import plates_from_storage
from solver.common.errors import CaptureError
from solver.export.conversion.file_content import BodyForces, Content, Trial
from solver.export.export_places import file_stem
from solver.export.opensim import write_body_forces, write_external_loads, write_motion, write_torques
from solver.export.opensim_setups import SetupFiles, write_inverse_dynamics_setup
from solver.kinematics.motion import Motion
from solver.skeleton.osim import load_skeleton
from solver.skeleton.osim_writer import skeleton_text
from solver.skeleton.skeleton import Skeleton

MOTION, FORCES, PLATES, TORQUES, LOADS = "_ik.mot", "_grf.mot", "_plates", "_id.sto", "_external_loads.xml"
SETUP = "_id_setup.xml"


def is_opensim_set(folder: Path) -> bool:
    """Whether a folder holds a model and a motion of it."""
    return any(folder.glob("*.osim")) and any(folder.glob(f"*{MOTION}"))


def read_opensim_set(folder: Path) -> Content:
    """Read a model and all its trials.

    Raises:
        CaptureError: there are several models, or a file cannot be read.
        ModelError: the model cannot be read.
    """
    models = sorted(folder.glob("*.osim"))
    if len(models) != 1:
        raise CaptureError(
            f"{folder}: {len(models)} .osim files ({', '.join(model.name for model in models)}), but one is "
            "needed: the model that the motions are of. Move the others away."
        )
    skeleton = load_skeleton(models[0])
    trials: list[Trial] = []
    notes: list[str] = []
    used = {models[0]}
    for path in sorted(folder.glob(f"*{MOTION}")):
        trial, files, said = _read_trial(path, skeleton)
        trials.append(trial)
        used |= files
        notes += said
    written = {folder / f"{trial.name}{ending}" for trial in trials for ending in (LOADS, SETUP)}
    others = sorted(p.name for p in folder.iterdir() if p.is_file() and p not in used | written)
    return Content(
        source=folder,
        trials=tuple(trials),
        skeleton=skeleton,
        model_text=models[0].read_text(encoding="utf-8", errors="replace"),
        mass_kg=skeleton.mass,
        left_behind=tuple(others),
        notes=tuple(notes),
    )


def read_motion(path: Path, skeleton: Skeleton) -> tuple[Motion, tuple[str, ...]]:
    """A table of coordinates as a motion of a model; coordinates that it lacks stay at the model's values.

    Raises:
        CaptureError: the file cannot be read, or holds none of the model's coordinates.
    """
    storage = read_storage(path)
    angles = {c.name for c in skeleton.free_coordinates if c.motion == "rotation"}
    found = coordinates_from_storage(storage, angles)
    missing = [name for name in skeleton.dofs if name not in found.names]
    if len(missing) == len(skeleton.dofs):
        raise CaptureError(
            f"{path}: holds none of the coordinates of {skeleton.name} ({', '.join(skeleton.dofs[:6])}, …). "
            "Is it a motion of this model?"
        )
    defaults = np.tile(skeleton.default_q, (len(found.times), 1))
    for k, name in enumerate(skeleton.dofs):
        if name in found.names:
            defaults[:, k] = found.values[:, found.names.index(name)]
    notes: tuple[str, ...] = found.notes
    if missing:
        notes += (f"{path.name}: lacks {', '.join(missing)}; they stay at the model's values",)
    return Motion(skeleton.dofs, defaults, storage.rate, float(found.times[0])), notes


def write_opensim_set(content: Content, folder: Path) -> tuple[str, ...]:
    """Write the model, and for each trial what there is of it.

    Raises:
        CaptureError, ModelError: a file cannot be written.
    """
    assert content.skeleton is not None
    text = content.model_text or skeleton_text(content.skeleton)
    write_whole(folder / "model.osim", text)
    for trial in content.trials:
        stem = folder / file_stem(trial.name)
        if trial.motion is not None:
            write_motion(trial.motion, content.skeleton, stem.with_name(stem.name + MOTION))
            _write_dynamics(trial, content.skeleton, stem)
        if trial.markers is not None:
            write_trc(stem.with_name(f"{stem.name}.trc"), trial.markers)
        for number, plates in enumerate(by_clock(trial.plates)):
            ending = f"{PLATES}_{number + 1}.mot" if number else f"{PLATES}.mot"
            write_plates(stem.with_name(stem.name + ending), plates)
    return ()


def by_clock(plates: Sequence[ForcePlate]) -> list[list[ForcePlate]]:
    """Plates whose samples have the same times, together."""
    groups: dict[tuple[float, float, int], list[ForcePlate]] = {}
    for plate in plates:
        groups.setdefault((plate.rate, plate.start_time, plate.samples), []).append(plate)
    return list(groups.values())


def write_plates(path: Path, plates: Sequence[ForcePlate]) -> None:
    """Force, point and moment about that point of plates of one clock, in OpenSim's columns.

    The point is the centre of pressure; while there is none, the ground's origin.

    Raises:
        CaptureError: the file cannot be written.
    """
    labels, columns = [], []
    for number, plate in enumerate(plates, start=1):
        point = np.where(np.isfinite(plate.cop_ground), plate.cop_ground, 0.0)
        labels += [f"ground_force_{number}_{kind}{axis}" for kind in "vp" for axis in "xyz"]
        labels += [f"ground_torque_{number}_{axis}" for axis in "xyz"]
        columns += [plate.force_ground, point, plate.moment_ground - np.cross(point, plate.force_ground)]
    write_storage(path, labels, plates[0].times, np.hstack(columns))


def _read_trial(path: Path, skeleton: Skeleton) -> tuple[Trial, set[Path], tuple[str, ...]]:
    name = path.name.removesuffix(MOTION)
    motion, notes = read_motion(path, skeleton)
    used = {path}
    markers, torques, contacts = None, None, None
    plates: list[ForcePlate] = []
    beside = {ending: path.with_name(name + ending) for ending in (".trc", FORCES, TORQUES)}
    if beside[".trc"].is_file():
        found = read_trc(beside[".trc"])
        markers, notes = found.markers, (*notes, *found.notes)
        used.add(beside[".trc"])
    for file in sorted(path.parent.glob(f"{escape(name)}{PLATES}*.mot")):
        read, said = plates_from_storage(read_storage(file))
        plates += read
        notes = (*notes, *said)
        used.add(file)
    if beside[FORCES].is_file():
        contacts = _read_body_forces(read_storage(beside[FORCES]), skeleton, motion)
        used |= {beside[FORCES]} if contacts else set()
    if beside[TORQUES].is_file():
        torques = _read_torques(read_storage(beside[TORQUES]), skeleton, motion)
        used |= set() if torques is None else {beside[TORQUES]}
    return Trial(name, markers, tuple(plates), (), motion, torques, contacts), used, notes


def _read_body_forces(storage: Storage, skeleton: Skeleton, motion: Motion) -> BodyForces | None:
    """Forces whose columns are named after bodies, as exports of a fit have them; None for others."""
    bodies = [name for name in skeleton.body_names if f"ground_force_{name}_vx" in storage.labels]
    if not bodies or len(storage.times) != motion.frames:
        return None
    wrenches, points = [], []
    for body in bodies:
        force, point, torque = (
            np.column_stack([storage.column(f"ground_{words}{axis}") for axis in "xyz"])
            for words in (f"force_{body}_v", f"force_{body}_p", f"torque_{body}_")
        )
        wrenches.append(np.hstack([force, torque + np.cross(point, force)]))
        points.append(np.where(force[:, 1:2] > 0, point, np.nan))
    return BodyForces(tuple(bodies), np.stack(wrenches, axis=1), np.stack(points, axis=1))


def _read_torques(
    storage: Storage, skeleton: Skeleton, motion: Motion
) -> Float[np.ndarray, "frames dofs"] | None:
    """Generalized forces of all coordinates; None where the table has others, or other frames."""
    named = {
        label.removesuffix("_moment").removesuffix("_force"): k for k, label in enumerate(storage.labels)
    }
    if len(storage.times) != motion.frames or any(name not in named for name in skeleton.dofs):
        return None
    return storage.values[:, [named[name] for name in skeleton.dofs]]


def _write_dynamics(trial: Trial, skeleton: Skeleton, stem: Path) -> None:
    """Torques, forces on bodies, and what OpenSim's inverse dynamics needs to run on them."""
    motion = trial.motion
    assert motion is not None
    if trial.torques is not None:
        write_torques(stem.with_name(stem.name + TORQUES), skeleton, motion.times, trial.torques)
    if trial.contacts is None:
        return
    forces, loads = stem.with_name(stem.name + FORCES), stem.with_name(stem.name + LOADS)
    contacts = trial.contacts
    write_body_forces(forces, contacts.bodies, contacts.wrench_ground, contacts.cop_ground, motion.times)
    write_external_loads(loads, contacts.bodies, forces)
    span, motion_file = (motion.times[0], motion.times[-1]), stem.name + MOTION
    write_inverse_dynamics_setup(SetupFiles(stem.parent, stem.name, motion_file, loads.name, span, span))
