"""Bone meshes from files (VTP, OBJ, STL), thinned to what a browser draws quickly, and kept on disk."""

import hashlib
import os
import sys
import zipfile
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from solver.capture.atomic import made_folder, whole_file
from solver.common.errors import CaptureError, ModelError
from solver.skeleton.vtp import read_vtp

SUFFIXES = (".vtp", ".obj", ".stl")


@dataclass(frozen=True)
class MeshSettings:
    """How finely bones are drawn, and what a model may ask us to load."""

    triangles_per_square_metre: float = 5000.0  # ribs and vertebrae are all surface
    triangles_per_metre: float = (
        800.0  # of the bounding box's diagonal, for the slender bones of hand and foot
    )
    fewest_triangles: int = 60  # below this a phalanx is a splinter
    most_triangles: int = 2500  # a whole body stays near 12 000, which software rendering still moves
    aggressions: tuple[int, ...] = (3, 5, 7)  # gentle first: 7 tears ribs, but 3 cannot thin a dense phalanx
    largest_file: int = 64 * 2**20  # bytes; a bone scan of a million triangles


def load_mesh(path: Path, settings: MeshSettings = MeshSettings()) -> trimesh.Trimesh:
    """A thinned mesh, in the file's own unit and frame.

    Raises:
        ModelError: the file is missing, too large, of another format, or holds no triangle.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise ModelError(f"{path}: bone meshes are read from {', '.join(SUFFIXES)}.")
    try:
        if path.stat().st_size > settings.largest_file:
            raise ModelError(f"{path}: larger than {settings.largest_file // 2**20} MB. Thin the mesh first.")
        content = path.read_bytes()
    except OSError as error:
        raise ModelError(f"{path}: cannot be read ({error.strerror}).") from error
    key = hashlib.sha256(content + path.suffix.lower().encode() + repr(settings).encode()).hexdigest()[:32]
    kept = cache_folder() / "bones" / f"{key}.npz"
    mesh = _kept_mesh(kept)
    if mesh is None:
        mesh = _thinned(_read(path), settings)
        _keep(mesh, kept)
    return mesh


def cache_folder() -> Path:
    """Where this user's programs keep what they can make again."""
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local"))
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return base / "addb-viewer"


def _read(path: Path) -> trimesh.Trimesh:
    if path.suffix.lower() == ".vtp":
        points, triangles = read_vtp(path)
        mesh = trimesh.Trimesh(points, triangles, process=True)
    else:
        try:
            with path.open("rb") as file:
                # No path goes along, so an .obj cannot make us open its material files.
                mesh = trimesh.load_mesh(file, file_type=path.suffix.lower()[1:], skip_materials=True)
        except Exception as error:  # trimesh's readers raise whatever their parsing met
            raise ModelError(f"{path}: not a readable mesh ({error}). Export it again.") from error
        if not isinstance(mesh, trimesh.Trimesh):
            raise ModelError(f"{path}: holds no triangles.")
    if len(mesh.faces) == 0 or not np.isfinite(mesh.vertices).all():
        raise ModelError(f"{path}: holds no triangles with finite corners.")
    return trimesh.Trimesh(mesh.vertices, mesh.faces, process=True)


def _thinned(mesh: trimesh.Trimesh, settings: MeshSettings) -> trimesh.Trimesh:
    diagonal = float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))
    wanted = settings.triangles_per_square_metre * mesh.area + settings.triangles_per_metre * diagonal
    target = int(np.clip(wanted, settings.fewest_triangles, settings.most_triangles))
    thinned = mesh
    for aggression in settings.aggressions:
        if len(thinned.faces) <= 1.1 * target:
            break
        thinned = mesh.simplify_quadric_decimation(face_count=target, aggression=aggression)
    # In single precision, as it's kept: the second time must give what the first gave.
    return trimesh.Trimesh(thinned.vertices.astype(np.float32), thinned.faces, process=False)


def _kept_mesh(path: Path) -> trimesh.Trimesh | None:
    try:
        with np.load(path, allow_pickle=False) as arrays:
            return trimesh.Trimesh(arrays["vertices"], arrays["faces"], process=False)
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None


def _keep(mesh: trimesh.Trimesh, path: Path) -> None:
    """Whole or not at all.

    A home that cannot be written costs half a second at the next start, nothing else.
    """
    with suppress(CaptureError), whole_file(made_folder(path.parent) / path.name) as file:
        np.savez(file, vertices=mesh.vertices.astype(np.float32), faces=mesh.faces.astype(np.int32))
