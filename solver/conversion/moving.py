"""A model and its motion for Blender, browsers and MuJoCo."""

from pathlib import Path

from solver.conversion.content import Content
from solver.export.gltf import moving_skeleton
from solver.export.mujoco import write_mujoco
from solver.skeleton.bones import body_meshes


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
