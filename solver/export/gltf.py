"""The moving skeleton as glTF 2.0: a .glb file a trial, for Blender, browsers and game engines.

One node a body, with the body's name and its bone, hanging on the node of the body that carries it; y up,
metres, seconds from the trial's first frame. A node that moves has a channel for its place, its orientation,
or both, with a key at every frame; one that does not move in its parent has its place on itself.
"""

from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from jaxtyping import Float
from trimesh.exchange.gltf import export_glb
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from solver.capture.atomic import made_folder, whole_file
from solver.export.export_places import trial_stems
from solver.fitting.fit_result import Fit
from solver.kinematics.motion import Motion
from solver.skeleton.bones import body_meshes
from solver.skeleton.forward import body_poses
from solver.skeleton.rotations import quaternions
from solver.skeleton.skeleton import Skeleton

Tree = dict[str, Any]  # the JSON part of a glTF file
GROUND = "ground"  # what bodies without a parent hang on; no node is written for it
BONE_COLOUR = (222, 211, 190, 255)
FLOAT, SHAPES = 5126, {1: "SCALAR", 3: "VEC3", 4: "VEC4"}  # glTF 2.0, tables 3.6.2.2 and 3.6.2.3
LEAST_NORMAL = 0.5  # unit vectors have length 1, cancelled ones 0
STILL = 1e-9  # [m, or of a quaternion] less movement than glTF's single precision shows


def export_gltf(fit: Fit, folder: Path) -> list[Path]:
    """Write TRIAL.glb for every trial; the motion is the one that torques and residuals were computed on.

    Raises:
        CaptureError: the folder cannot be made, or not written to.
    """
    meshes = body_meshes(fit.skeleton, fit.subject.folder / "Geometry").meshes
    stems, written = trial_stems(fit), []
    for trial in fit.trials:
        motion = trial.dynamics.motion if trial.dynamics else trial.motion
        path = made_folder(folder) / f"{stems[trial.capture.name]}.glb"
        content = moving_skeleton(fit.skeleton, meshes, motion, trial.capture.name)
        with whole_file(path) as file:
            file.write(content)
        written.append(path)
    return written


def moving_skeleton(
    skeleton: Skeleton, meshes: dict[str, trimesh.Trimesh], motion: Motion, name: str
) -> bytes:
    """The contents of a .glb file; frames without a pose have no key.

    Args:
        skeleton: at the subject's scale.
        meshes: by body, in its frame; a body may lack one.
        motion: of the skeleton's coordinates.
        name: of the animation.
    """
    scene = _scene(skeleton, meshes)
    scene.metadata.update(trial=name, rate_Hz=motion.rate, start_time_s=motion.start_time)
    posed = np.flatnonzero(motion.posed)
    R, p = body_poses(skeleton, motion.q[posed])

    def animate(buffers: dict[object, bytes], tree: Tree) -> None:
        tree["asset"]["generator"] = f"addb-viewer {version('addb-viewer')}"
        accessors = _Accessors(buffers, tree)
        seconds = accessors.add(posed / motion.rate, bounded=True)
        moving = _Animation(tree, accessors, seconds)
        for body, (place, turn) in enumerate(_in_parents(skeleton, R, p)):
            moving.move(skeleton.bodies[body].name, "translation", place)
            moving.move(skeleton.bodies[body].name, "rotation", turn)
        if moving.channels:
            tree["animations"] = [{"name": name, "channels": moving.channels, "samplers": moving.samplers}]

    return bytes(export_glb(scene, include_normals=True, buffer_postprocessor=animate))


def _scene(skeleton: Skeleton, meshes: dict[str, trimesh.Trimesh]) -> trimesh.Scene:
    """The tree of bodies, all of them where their parents are."""
    scene = trimesh.Scene(base_frame=GROUND)
    bone = PBRMaterial(
        name="bone", baseColorFactor=BONE_COLOUR, metallicFactor=0.0, roughnessFactor=0.8, doubleSided=True
    )
    for body, joint in zip(skeleton.bodies, skeleton.joints, strict=True):
        parent = GROUND if joint.parent < 0 else skeleton.bodies[joint.parent].name
        mesh = meshes.get(body.name)
        if mesh is None:
            scene.graph.update(frame_to=body.name, frame_from=parent, matrix=np.eye(4))
            continue
        scene.add_geometry(
            _drawn(mesh, bone), node_name=body.name, geom_name=body.name, parent_node_name=parent
        )
    return scene


def _drawn(mesh: trimesh.Trimesh, material: PBRMaterial) -> trimesh.Trimesh:
    """The mesh with unit normals: a corner between faces back to back has none, and takes one of theirs."""
    whole = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    whole.update_faces(whole.nondegenerate_faces())
    whole.remove_unreferenced_vertices()
    normals = np.array(whole.vertex_normals)
    lost = np.linalg.norm(normals, axis=1) < LEAST_NORMAL
    for corner in whole.faces.T:
        normals[corner[lost[corner]]] = whole.face_normals[lost[corner]]
    visual = TextureVisuals(material=material)
    return trimesh.Trimesh(whole.vertices, whole.faces, vertex_normals=normals, process=False, visual=visual)


def _in_parents(
    skeleton: Skeleton, R: Float[np.ndarray, "frames bodies 3 3"], p: Float[np.ndarray, "frames bodies 3"]
) -> Sequence[tuple[Float[np.ndarray, "frames 3"], Float[np.ndarray, "frames 4"]]]:
    """By body, its place [m] and unit quaternion (x, y, z, w) in the frame of the body that carries it."""
    placed = []
    for body, joint in enumerate(skeleton.joints):
        place, turn = p[:, body], R[:, body]
        if joint.parent >= 0:
            to_parent = R[:, joint.parent].transpose(0, 2, 1)
            place = (to_parent @ (place - p[:, joint.parent])[..., None])[..., 0]
            turn = to_parent @ turn
        placed.append((place, _continuous(quaternions(turn))))
    return placed


def _continuous(quaternions: Float[np.ndarray, "frames 4"]) -> Float[np.ndarray, "frames 4"]:
    """Of q and −q, which mean the same, the one nearer to the frame before."""
    flips = np.sum(quaternions[1:] * quaternions[:-1], axis=1) < 0
    signs = np.where(np.cumsum(flips) % 2, -1.0, 1.0)
    return quaternions * np.concatenate([[1.0], signs])[:, None]


class _Accessors:
    """Appends arrays to a file's buffer."""

    def __init__(self, buffers: dict[object, bytes], tree: Tree) -> None:
        self.buffers, self.accessors = buffers, tree["accessors"]

    def add(self, values: np.ndarray, *, bounded: bool = False) -> int:
        """The array's number; `bounded` for the times of an animation, whose range the file has to state."""
        values = np.asarray(values, dtype="<f4")
        width = values.shape[1] if values.ndim == 2 else 1
        accessor: Tree = {
            "bufferView": len(self.buffers),
            "componentType": FLOAT,
            "count": len(values),
            "type": SHAPES[width],
        }
        if bounded:
            accessor |= {"min": [float(values.min())], "max": [float(values.max())]}
        number = len(self.accessors)
        self.buffers["motion", number] = values.tobytes()
        self.accessors["motion", number] = accessor
        return number


class _Animation:
    """Collects the channels of an animation."""

    def __init__(self, tree: Tree, accessors: _Accessors, seconds: int) -> None:
        self.nodes, self.accessors, self.seconds = tree["nodes"], accessors, seconds
        self.numbers = {node["name"]: number for number, node in enumerate(self.nodes)}
        self.channels: list[Tree] = []
        self.samplers: list[Tree] = []

    def move(self, name: str, path: str, values: Float[np.ndarray, "frames _"]) -> None:
        """Give a node its first value, and the others where there are others."""
        node = self.numbers[name]
        self.nodes[node][path] = values[0].tolist()
        if np.ptp(values, axis=0).max() < STILL:
            return
        sampler = {"input": self.seconds, "output": self.accessors.add(values), "interpolation": "LINEAR"}
        self.channels.append({"sampler": len(self.samplers), "target": {"node": node, "path": path}})
        self.samplers.append(sampler)
