"""Results as files that OpenSim 4.6 opens, and runs its own inverse dynamics on, as they are.

model.osim                  the fitted skeleton
TRIAL_ik.mot                the motion that the joint torques belong to, already filtered; radians and metres
TRIAL_grf.mot               the recorded forces after conditioning, a set of columns for each foot
TRIAL_grf_predicted.mot      in its place where no force counts: predicted, what the torques rest on
TRIAL_external_loads.xml    which foot each set acts on
TRIAL_id.sto                our joint torques; where a foot's force is missing they rest on a wrench predicted
                            from the motion, and the first line names these frames
TRIAL_id_setup.xml          OpenSim's inverse dynamics of the same files, without a second filter
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float

from solver.capture.formats.coordinates import write_coordinates
from solver.capture.formats.storage import write_storage
from solver.common.plate_figures import CONTACT_N
from solver.common.runs import runs
from solver.dynamics.dynamics import Dynamics
from solver.dynamics.inverse_dynamics import counted_wrenches
from solver.export.opensim_setup import write_external_loads, write_inverse_dynamics_setup
from solver.export.places import made, trial_stems
from solver.fitting.fit import Fit, TrialFit
from solver.fitting.seen_part import without_guesses
from solver.kinematics.motion import Motion
from solver.skeleton.osim_writer import write_skeleton
from solver.skeleton.skeleton import Coordinate, Skeleton

AXES = "xyz"


def export_opensim(fit: Fit, folder: Path) -> list[Path]:
    """Write a fit for OpenSim.

    Angles are radians, so that no program has to guess which coordinates are angles. Where no force
    counts, the file of forces holds predicted ones and says so in its name.

    Args:
        fit: the solved subject.
        folder: made where it is missing.

    Returns:
        The files written.

    Raises:
        FitError: the folder cannot be made.
        CaptureError, ModelError: a file cannot be written.
    """
    model = made(folder) / "model.osim"
    write_skeleton(fit.skeleton, model)
    written, stems = [model], trial_stems(fit)
    for trial in fit.trials:
        written += _export_trial(trial, fit.skeleton, folder, stems[trial.capture.name])
    return written


def _export_trial(trial: TrialFit, skeleton: Skeleton, folder: Path, stem: str) -> list[Path]:
    ik = folder / f"{stem}_ik.mot"
    if trial.dynamics is None or trial.contacts is None or trial.mask is None:
        write_motion(trial.motion, skeleton, ik)
        return [ik]
    forces = folder / f"{stem}_grf{'_predicted' if trial.forces_predicted else ''}.mot"
    torques = folder / f"{stem}_id.sto"
    loads, setup = folder / f"{stem}_external_loads.xml", folder / f"{stem}_id_setup.xml"
    times = trial.dynamics.motion.times
    told = trial.dynamics.motion.posed
    shown = without_guesses(trial).dynamics or trial.dynamics
    write_motion(trial.dynamics.motion, skeleton, ik)
    predicted = trial.dynamics.wrench_predicted_ground
    if trial.forces_predicted and predicted is not None:
        _write_predicted(trial.contacts.foot_bodies, predicted, times, forces)
    else:
        wrenches = counted_wrenches(trial.contacts.wrench_ground, trial.mask)
        write_body_forces(forces, trial.contacts.foot_bodies, wrenches, trial.contacts.cop_ground, times)
    name = f"{torques.stem}{_predicted(trial.dynamics)}"
    write_torques(torques, skeleton, times[told], shown.joint_torques[told], name)
    write_external_loads(loads, trial.contacts.foot_bodies, forces)
    write_inverse_dynamics_setup(
        setup,
        model="model.osim",
        coordinates=ik,
        loads=loads,
        span=(times[told][0], times[told][-1]),
        result=f"{stem}_id_opensim.sto",
    )
    return [ik, forces, torques, loads, setup]


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
) -> None:
    """Force, point and remaining torque of each body, in columns with its name.

    Args:
        path: of the file.
        bodies: that the forces act on.
        wrench_ground: force [N] and moment about the ground origin [N·m].
        cop_ground: centres of pressure [m], NaN while there is none.
        times: of the frames [s].

    Raises:
        CaptureError: the file cannot be written.
    """
    labels, columns = [], []
    for k, body in enumerate(bodies):
        point = _held(cop_ground[:, k])
        force, moment = wrench_ground[:, k, :3], wrench_ground[:, k, 3:]
        labels += [f"ground_force_{body}_v{axis}" for axis in AXES]
        labels += [f"ground_force_{body}_p{axis}" for axis in AXES]
        labels += [f"ground_torque_{body}_{axis}" for axis in AXES]
        columns += [force, point, moment - np.cross(point, force)]
    write_storage(path, labels, times, np.hstack(columns))


def _write_predicted(
    feet: Sequence[str],
    wrenches: Float[np.ndarray, "frames feet 6"],
    times: Float[np.ndarray, " frames"],
    path: Path,
) -> None:
    """Forces that nobody measured, each at the point of the floor's height where it has no level moment."""
    labels, columns = [], []
    for f, foot in enumerate(feet):
        labels += [f"ground_force_{foot}_v{axis}" for axis in AXES]
        labels += [f"ground_force_{foot}_p{axis}" for axis in AXES]
        labels += [f"ground_torque_{foot}_{axis}" for axis in AXES]
        force, moment = wrenches[:, f, :3], wrenches[:, f, 3:]
        loaded = force[:, 1] >= CONTACT_N
        up = np.where(loaded, force[:, 1], 1.0)
        point = np.column_stack([moment[:, 2] / up, np.zeros(len(up)), -moment[:, 0] / up])
        point[~loaded] = 0.0
        columns += [force, point, moment - np.cross(point, force)]
    write_storage(path, labels, times, np.hstack(columns), name=f"{path.stem}; predicted, not measured")


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
