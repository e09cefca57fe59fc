"""What each body looks like: one mesh a body, in the body frame, at the skeleton's scale."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import numpy as np
import trimesh
from jaxtyping import Float

from solver.common.errors import ModelError
from solver.common.notes import Kind, Note, noted
from solver.skeleton.bone_library import StockBone, stock_bones, stock_folder
from solver.skeleton.mesh_files import SUFFIXES, load_mesh
from solver.skeleton.skeleton import Body, Geometry, Skeleton


@dataclass(frozen=True)
class Bones:
    """Meshes by body name; a body without extent has none. `notes` says what had to be replaced by what."""

    meshes: dict[str, trimesh.Trimesh]
    notes: tuple[Note, ...] = ()


@dataclass(frozen=True)
class CapsuleSettings:
    """Bodies that no mesh draws become rods between their joint centres."""

    shortest: float = 0.02  # [m] shorter ones are joint-coupling bodies, not limbs
    slenderness: float = 0.06  # radius over length
    thinnest: float = 0.008  # [m]
    thickest: float = 0.02  # [m]


MOST_STRETCH = 1.4  # of a stock bone; a model that asks for more means something else by the name


def body_meshes(skeleton: Skeleton, geometry_folder: Path | None = None) -> Bones:
    """Draw every body: the user's own mesh, else a stock bone, else a rod between joint centres.

    Args:
        skeleton: at any scale; its geometries carry their own scale and place in the body.
        geometry_folder: the folder with the model's mesh files; only files directly in it are opened,
            whatever path the model names.
    """
    meshes: dict[str, trimesh.Trimesh] = {}
    notes: list[Note] = []
    missing: list[str] = []
    rods: list[str] = []
    for index, body in enumerate(skeleton.bodies):
        parts: list[trimesh.Trimesh] = []
        for geometry in body.geometry:
            mesh, trouble = _geometry_mesh(geometry, geometry_folder, _reach(skeleton, index))
            notes += trouble
            parts += [mesh] if mesh is not None else []
            missing += [geometry.file] if mesh is None else []
        if not parts:
            parts = list(_rods(skeleton, index, body))
            rods += [body.name] if parts else []
        if parts:
            meshes[body.name] = _joined(parts)
    if stock_folder() is None:
        notes += noted(
            Kind.OTHER, "The bone meshes of the package myo-sim are not installed; bodies are drawn as rods."
        )
    if missing:
        notes += noted(
            Kind.DRAWING,
            f"No bone mesh for {', '.join(dict.fromkeys(missing))}; put the files into Geometry/.",
        )
    if rods:
        notes += noted(Kind.DRAWING, f"Drawn as rods: {', '.join(rods)}.")
    return Bones(meshes, tuple(notes))


def _geometry_mesh(
    geometry: Geometry, folder: Path | None, reach: float
) -> tuple[trimesh.Trimesh | None, list[Note]]:
    """The geometry in its body's frame, and what went wrong with the user's own file."""
    notes: list[Note] = []
    own = _own_file(geometry.file, folder)
    if own is not None:
        try:
            return _placed(load_mesh(own).copy(), geometry), notes
        except ModelError as error:
            notes += noted(Kind.OTHER, str(error))
    stock = stock_bones(_file_name(geometry.file))
    if not stock:
        return None, notes
    placed = [_stretched(_placed(_stock_mesh(bone), geometry), bone, geometry, reach) for bone in stock]
    return _joined(placed), notes


def _own_file(name: str, folder: Path | None) -> Path | None:
    """The user's file of that name or stem, in any case and format; never outside the folder."""
    if folder is None or not folder.is_dir():
        return None
    inside = folder.resolve()
    wanted = Path(_file_name(name))
    files = [
        f for f in sorted(inside.iterdir()) if f.suffix.lower() in SUFFIXES and f.resolve().parent == inside
    ]
    same = [f for f in files if f.name.lower() == wanted.name.lower()]
    return next(iter(same + [f for f in files if f.stem.lower() == wanted.stem.lower()]), None)


def _file_name(name: str) -> str:
    """The last part of a path of either operating system."""
    return name.replace("\\", "/").rsplit("/", 1)[-1]


def _stock_mesh(bone: StockBone) -> trimesh.Trimesh:
    mesh = load_mesh(bone.path).copy()
    placement = bone.placement
    mesh.vertices = placement.scale * mesh.vertices @ placement.R_file_stock.T + placement.p_file_stock
    if bone.mirrored:
        mesh.vertices *= [1.0, 1.0, -1.0]
        mesh.invert()
    return mesh


def _stretched(mesh: trimesh.Trimesh, bone: StockBone, geometry: Geometry, reach: float) -> trimesh.Trimesh:
    """Lengthen a stock bone so that it ends where the model has the next joint."""
    if bone.reach is not None:
        factor = reach / (bone.reach * geometry.scale[1])
        if 1 / MOST_STRETCH <= factor <= MOST_STRETCH:
            mesh.vertices *= [1.0, factor, 1.0]
    return mesh


def _reach(skeleton: Skeleton, index: int) -> float:
    """How far below the body's origin its farthest child's joint lies [m]."""
    return -min((j.p_parent_frame[1] for j in skeleton.joints if j.parent == index), default=0.0)


def _joined(meshes: list[trimesh.Trimesh]) -> trimesh.Trimesh:
    return cast(trimesh.Trimesh, trimesh.util.concatenate(meshes))


def _placed(mesh: trimesh.Trimesh, geometry: Geometry) -> trimesh.Trimesh:
    mesh.vertices = (mesh.vertices * geometry.scale) @ geometry.R_body_mesh.T + geometry.p_body_mesh
    if np.prod(geometry.scale) < 0:  # a model mirrors a right bone by a negative scale
        mesh.invert()
    return mesh


def _rods(skeleton: Skeleton, index: int, body: Body) -> Iterator[trimesh.Trimesh]:
    start = skeleton.joints[index].p_child_frame
    ends = [joint.p_parent_frame for joint in skeleton.joints if joint.parent == index]
    for end in ends or [2.0 * body.com_body - start]:
        if np.linalg.norm(end - start) >= CapsuleSettings.shortest:
            yield _rod(start, end)


def _rod(start: Float[np.ndarray, "3"], end: Float[np.ndarray, "3"]) -> trimesh.Trimesh:
    settings = CapsuleSettings()
    length = float(np.linalg.norm(end - start))
    radius = float(np.clip(settings.slenderness * length, settings.thinnest, settings.thickest))
    mesh = trimesh.creation.capsule(height=max(length - 2 * radius, 0.0), radius=radius, count=[8, 8])
    mesh.apply_translation([0.0, 0.0, -0.5 * mesh.bounds.sum(axis=0)[2]])
    mesh.apply_transform(trimesh.geometry.align_vectors([0.0, 0.0, 1.0], (end - start) / length))
    mesh.apply_translation(0.5 * (start + end))
    return mesh
