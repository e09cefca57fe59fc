"""Results as files that OpenSim 4.6 opens, and runs its own inverse dynamics on, as they are.

model.osim                  the subject's own model, or our skeleton, as fitted
TRIAL_ik.mot                the motion that the joint torques belong to, already filtered; radians and metres
TRIAL_grf.mot               the recorded forces after conditioning, a set of columns for each foot
TRIAL_grf_predicted.mot      in its place where no force counts: predicted, what the torques rest on
TRIAL_external_loads.xml    which foot each set acts on
TRIAL_id.sto                our joint torques; where a foot's force is missing they rest on a wrench predicted
                            from the motion, and the first line names these frames
TRIAL_id_std.sto            their standard deviations, nan where none is known, of a motion fitted to forces
TRIAL_…_setup.xml           runs of OpenSim's tools on the same files
"""

from collections.abc import Sequence
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement

import numpy as np
from jaxtyping import Float

from solver.capture.atomic import made_folder, whole_file, write_whole
from solver.capture.formats.storage import write_coordinates, write_storage
from solver.common.errors import ModelError
from solver.common.plate_figures import CONTACT_N
from solver.common.true_runs import runs
from solver.dynamics.dynamics import Dynamics
from solver.dynamics.inverse_dynamics import counted_wrenches
from solver.export.export_places import trial_stems
from solver.export.opensim_setups import (
    VERSION,
    SetupFiles,
    set_property,
    write_document,
    write_inverse_dynamics_setup,
    write_muscle_setups,
    write_reserves,
)
from solver.fitting.fit_result import Fit, TrialFit
from solver.fitting.seen_part import without_guesses
from solver.kinematics.motion import Motion
from solver.skeleton.added_muscles import with_muscles_of
from solver.skeleton.osim_writer import write_skeleton
from solver.skeleton.skeleton import Coordinate, Skeleton
from solver.skeleton.subject_model import subject_model_content


def export_opensim(fit: Fit, folder: Path, muscles_from: Path | None = None) -> list[Path]:
    """Write a fit for OpenSim.

    Angles are radians, so that no program has to guess which coordinates are angles. Where no force
    counts, the file of forces holds predicted ones and says so in its name.

    Args:
        fit: the solved subject.
        folder: made where it is missing.
        muscles_from: a model whose muscles the default body gets; of no use where the subject has its own.

    Returns:
        The files written.

    Raises:
        CaptureError, ModelError: the folder cannot be made, or a file not written.
    """
    model = made_folder(folder) / "model.osim"
    if muscles_from is not None and fit.subject.model is not None:
        raise ModelError(
            f"{fit.subject.model}: the subject's own model keeps its muscles; leave out --muscles-from."
        )
    if muscles_from is not None:
        write_whole(model, with_muscles_of(muscles_from, fit.skeleton))
    elif fit.subject.model is None:
        write_skeleton(fit.skeleton, model)
    else:
        with whole_file(model) as file:
            file.write(subject_model_content(fit.subject.model, fit.skeleton))
    reserves = write_reserves(model, fit.skeleton) if fit.subject.model or muscles_from else []
    written, stems = [model, *reserves], trial_stems(fit)
    for trial in fit.trials:
        files, setups = _export_trial(trial, fit.skeleton, folder, stems[trial.capture.name])
        written += files
        written += write_muscle_setups(setups) if setups and reserves else []
    return written


def _export_trial(
    trial: TrialFit, skeleton: Skeleton, folder: Path, stem: str
) -> tuple[list[Path], SetupFiles | None]:
    """Files of a trial, and those that setups name, if it has torques."""
    ik = folder / f"{stem}_ik.mot"
    if trial.dynamics is None or trial.contacts is None or trial.mask is None:
        write_motion(trial.motion, skeleton, ik)
        return [ik], None
    forces = folder / f"{stem}_grf{'_predicted' if trial.forces_predicted else ''}.mot"
    torques = folder / f"{stem}_id.sto"
    loads = folder / f"{stem}_external_loads.xml"
    times = trial.dynamics.motion.times
    posed = trial.dynamics.motion.posed
    shown = without_guesses(trial)
    write_motion(trial.dynamics.motion, skeleton, ik)
    predicted = trial.dynamics.wrench_predicted_ground
    feet, name = trial.contacts.foot_bodies, ""
    if trial.forces_predicted and predicted is not None:
        wrenches, points = predicted, _predicted_points(predicted)
        name = f"{forces.stem}; predicted, not measured"
    else:
        wrenches = counted_wrenches(trial.contacts.wrench_ground, trial.mask)
        points = trial.contacts.cop_ground
    write_body_forces(forces, feet, wrenches, points, times, name=name)
    title = f"{torques.stem}{_predicted(trial.dynamics)}"
    own = (shown.dynamics or trial.dynamics).joint_torques
    write_torques(torques, skeleton, times[posed], own[posed], title)
    span = times[posed][0], times[posed][-1]
    start, stop = max(runs(trial.dynamics.used & posed), key=lambda run: run[1] - run[0], default=(0, 0))
    counted = (times[start], times[stop - 1]) if stop > start else span
    setups = SetupFiles(folder, stem, ik.name, loads.name, span, counted)
    written = [ik, forces, torques, loads, write_inverse_dynamics_setup(setups)]
    if shown.std is not None:
        written.append(folder / f"{torques.stem}_std.sto")
        name = f"{written[-1].stem}; standard deviations of {torques.name}"
        write_torques(written[-1], skeleton, times[posed], shown.std.torque[posed], name)
    write_external_loads(loads, trial.contacts.foot_bodies, forces)
    return written, setups


def write_motion(motion: Motion, skeleton: Skeleton, path: Path) -> None:
    """All coordinates of the model, the locked and coupled ones too: OpenSim would take them as zero.

    A frame without a pose has no row; a coordinate that nobody saw is guessed, as a model needs all of them.

    Raises:
        CaptureError: the file cannot be written.
    """
    by_name = {c.name: c for c in skeleton.coordinates}
    values = np.column_stack([_values(c, by_name, motion) for c in skeleton.coordinates])
    posed = motion.posed
    write_coordinates(
        path, list(by_name), motion.times[posed], values[posed], rotational=(), in_degrees=False
    )


def _values(
    coordinate: Coordinate, by_name: dict[str, Coordinate], motion: Motion
) -> Float[np.ndarray, " frames"]:
    if coordinate.locked:
        return np.full(motion.frames, coordinate.default)
    if coordinate.coupling is None or coordinate.coupled_to is None:
        return motion.q[:, motion.dofs.index(coordinate.name)]
    return coordinate.coupling(_values(by_name[coordinate.coupled_to], by_name, motion))[0]


def write_body_forces(
    path: Path,
    bodies: Sequence[str],
    wrench_ground: Float[np.ndarray, "frames bodies 6"],
    cop_ground: Float[np.ndarray, "frames bodies 3"],
    times: Float[np.ndarray, " frames"],
    *,
    name: str = "",
) -> None:
    """Force, point and remaining torque of each body, in columns with its name.

    Args:
        path: of the file.
        bodies: that the forces act on.
        wrench_ground: force [N] and moment about the ground origin [N·m].
        cop_ground: centres of pressure [m], NaN while there is none.
        times: of the frames [s].
        name: title in the first line; the file's name if empty.

    Raises:
        CaptureError: the file cannot be written.
    """
    labels, columns = [], []
    for k, body in enumerate(bodies):
        point = _held(cop_ground[:, k])
        force, moment = wrench_ground[:, k, :3], wrench_ground[:, k, 3:]
        labels += [f"ground_force_{body}_{kind}{axis}" for kind in "vp" for axis in "xyz"]
        labels += [f"ground_torque_{body}_{axis}" for axis in "xyz"]
        columns += [force, point, moment - np.cross(point, force)]
    write_storage(path, labels, times, np.hstack(columns), name=name)


def _predicted_points(
    wrenches: Float[np.ndarray, "frames feet 6"],
) -> Float[np.ndarray, "frames feet 3"]:
    """The point of the floor's height where each wrench has no level moment [m]; 0 while it bears nothing."""
    up, moment = wrenches[..., 1], wrenches[..., 3:]
    loaded = up >= CONTACT_N
    up = np.where(loaded, up, 1.0)
    points = np.stack([moment[..., 2] / up, np.zeros(up.shape), -moment[..., 0] / up], axis=-1)
    return np.where(loaded[..., None], points, 0.0)


def _held(cop_ground: Float[np.ndarray, "frames 3"]) -> Float[np.ndarray, "frames 3"]:
    """While a foot is unloaded, its last centre of pressure (at first, the first one to come)."""
    known = np.flatnonzero(np.isfinite(cop_ground).all(axis=1))
    if not len(known):
        return np.zeros_like(cop_ground)
    last = np.searchsorted(known, np.arange(len(cop_ground)), side="right") - 1
    return cop_ground[known[np.maximum(last, 0)]]


def write_torques(
    path: Path,
    skeleton: Skeleton,
    times: Float[np.ndarray, " frames"],
    torques: Float[np.ndarray, "frames dofs"],
    name: str = "",
) -> None:
    """Named as OpenSim names them: moments of rotations, forces of everything else.

    Args:
        path: of the file.
        skeleton: whose free coordinates they belong to.
        times: of the frames [s].
        torques: generalized forces [N·m or N].
        name: title in the first line; the file's name if empty.

    Raises:
        CaptureError: the file cannot be written.
    """
    labels = [
        f"{c.name}_{'moment' if c.motion == 'rotation' else 'force'}" for c in skeleton.free_coordinates
    ]
    write_storage(path, labels, times, torques, name=name)


def _predicted(dynamics: Dynamics) -> str:
    if dynamics.wrench_is_predicted is None:
        return ""
    stretches = runs(np.any(dynamics.wrench_is_predicted, axis=1))
    listed = ", ".join(f"{start}-{end - 1}" for start, end in stretches)
    return f"; a foot's wrench predicted from the motion on frames {listed}"


def write_external_loads(path: Path, foot_bodies: Sequence[str], forces: Path) -> None:
    """Say which body each foot's columns of a force file act on.

    Args:
        path: of the file to write, beside `forces`.
        foot_bodies: names of the bodies, as in the columns.
        forces: the .mot file.

    Raises:
        CaptureError: the file cannot be written.
    """
    document = Element("OpenSimDocument", Version=VERSION)
    loads = SubElement(document, "ExternalLoads", name=path.stem)
    objects = SubElement(loads, "objects")
    for foot in foot_bodies:
        force = SubElement(objects, "ExternalForce", name=foot)
        set_property(force, "applied_to_body", foot)
        set_property(force, "force_expressed_in_body", "ground")
        set_property(force, "point_expressed_in_body", "ground")
        set_property(force, "force_identifier", f"ground_force_{foot}_v")
        set_property(force, "point_identifier", f"ground_force_{foot}_p")
        set_property(force, "torque_identifier", f"ground_torque_{foot}_")
    set_property(loads, "datafile", forces.name)
    write_document(document, path)
