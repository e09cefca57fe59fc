"""The fit for MuJoCo: its model, its bones, and the motion of each trial as MuJoCo's qpos.

model.xml            the skeleton as MJCF, z up
model_bones/BODY.stl what each body looks like
TRIAL_motion.npz     time [s], qpos, qvel, qacc (frames × joints; rad, m), joints (names in the order of qpos)
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import trimesh
from trimesh.exchange.stl import export_stl

from solver.capture.atomic import whole_file, write_whole
from solver.common.file_names import distinct
from solver.export.mjcf import MujocoModel, mujoco_model
from solver.export.places import file_stem, made, trial_stems
from solver.fitting.fit import Fit
from solver.kinematics.motion import Motion
from solver.skeleton.bones import body_meshes
from solver.skeleton.chain import chain_of
from solver.skeleton.skeleton import Skeleton


def export_mujoco(fit: Fit, folder: Path) -> tuple[list[Path], tuple[str, ...]]:
    """Write model.xml, its bones, and TRIAL_motion.npz for every trial.

    Returns:
        The files written, and where the model had to differ from the skeleton.

    Raises:
        FitError, CaptureError: the folder cannot be made, or not written to.
    """
    meshes, stems = body_meshes(fit.skeleton, fit.subject.folder / "Geometry").meshes, trial_stems(fit)
    motions = {
        stems[trial.capture.name]: trial.dynamics.motion if trial.dynamics else trial.motion
        for trial in fit.trials
    }
    return write_mujoco(made(folder) / "model.xml", fit.skeleton, meshes, motions)


def write_mujoco(
    path: Path, skeleton: Skeleton, meshes: Mapping[str, trimesh.Trimesh], motions: Mapping[str, Motion]
) -> tuple[list[Path], tuple[str, ...]]:
    """Write a model, its bones beside it, and NAME_motion.npz for every motion.

    Args:
        path: of the model.
        skeleton: the model.
        meshes: by body, in its frame.
        motions: by the name that their files get.

    Raises:
        FitError, CaptureError: a folder cannot be made, or not written to.
    """
    place, written = made(path.with_name(f"{path.stem}_bones")), [path]
    files = {body: f"{stem}.stl" for body, stem in distinct(list(meshes), file_stem).items()}
    for body, name in files.items():
        with whole_file(place / name) as file:
            file.write(export_stl(meshes[body]))
        written.append(place / name)
    model = mujoco_model(skeleton, files, place.name)
    write_whole(path, model.xml)
    for name, motion in motions.items():
        written.append(path.with_name(f"{name}_motion.npz"))
        with whole_file(written[-1]) as file:
            np.savez_compressed(file, allow_pickle=False, **mujoco_motion(skeleton, model, motion))
    return written, model.notes


def mujoco_motion(skeleton: Skeleton, model: MujocoModel, motion: Motion) -> dict[str, np.ndarray]:
    """A motion in the joints of a MuJoCo model: the arrays of its file by name."""
    value, slope, curvature = chain_of(skeleton).couple(motion.q)
    dof, order = chain_of(skeleton).dof, list(model.positions)
    velocity = slope * motion.velocity[:, dof]
    acceleration = slope * motion.acceleration[:, dof] + curvature * motion.velocity[:, dof] ** 2
    return {
        "time": motion.times,
        "qpos": model.signs * value[:, order],
        "qvel": model.signs * velocity[:, order],
        "qacc": model.signs * acceleration[:, order],
        "joints": np.array(model.joints),
    }
