"""What each body looks like: one mesh a body, in the body frame, at the skeleton's scale."""

import importlib.util
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import cast
from xml.etree.ElementTree import Element

import numpy as np
import trimesh
from defusedxml import ElementTree
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from solver.common.errors import ModelError
from solver.common.notes import Kind, Note, noted
from solver.skeleton.mesh_files import SUFFIXES, load_mesh
from solver.skeleton.skeleton import Body, Geometry, Skeleton

_SIDE = re.compile(r"^(?:(?P<prefix>[rl])_)?(?P<bone>.+?)(?:_(?P<suffix>[rl])(?P<visible>v?s?m?\d*))?$")
_RIGHT_LEFT = ("femur", "tibia", "fibula", "patella", "talus", "foot", "bofoot", "pelvis")
_SHANK = ("tibia", "fibula")
_ANKLE_BELOW_KNEE = 0.40  # [m] in Rajagopal et al. 2016, whose shank this is; older models have 0.43 m
_SYNONYMS = {
    "pat": "patella", "calcn": "foot", "calcaneus": "foot", "calcaneous": "foot", "toes": "bofoot",
    "hip_bone": "pelvis", "innominate": "pelvis", "hat_ribs": "hat_ribs_scap", "ribs": "hat_ribs_scap",
}  # fmt: skip
_COMPOUND = {"hat_spine": ("hat_lumbar", "hat_thoracic", "hat_cervical")}
_CARPALS = ("pisiform", "lunate", "scaphoid", "triquetrum", "hamate", "capitate", "trapezoid", "trapezium")
_FINGERS = {"thumb": 1, "index": 2, "middle": 3, "ring": 4, "little": 5}
_PHALANX = {"proximal": "prox", "prox": "prox", "medial": "mid", "mid": "mid", "distal": "dist"}


@dataclass(frozen=True)
class Bones:
    """Meshes by body name; a body without extent has none. `notes` says what had to be replaced by what."""

    meshes: dict[str, trimesh.Trimesh]
    notes: tuple[Note, ...] = ()


# Bodies that no mesh draws become rods between their joint centres.
SHORTEST_ROD_M = 0.02  # shorter ones are joint-coupling bodies, not limbs
SLENDERNESS = 0.06  # radius over length
THINNEST_ROD_M, THICKEST_ROD_M = 0.008, 0.02
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


@dataclass(frozen=True)
class Placement:
    """Similarity from a stock mesh's frame to the frame of OpenSim's file of that bone, right side."""

    scale: float = 1.0
    R_file_stock: Float[np.ndarray, "3 3"] = field(default_factory=lambda: np.eye(3))
    p_file_stock: Float[np.ndarray, "3"] = field(default_factory=lambda: np.zeros(3))  # [m]

    def after(self, offset_stock: Float[np.ndarray, "3"]) -> "Placement":
        """The same for a mesh that lies at an offset in the stock frame."""
        return Placement(
            self.scale, self.R_file_stock, self.p_file_stock + self.scale * self.R_file_stock @ offset_stock
        )


@dataclass(frozen=True)
class StockBone:
    """One stock mesh standing in for (a part of) a model's mesh file."""

    path: Path
    placement: Placement
    mirrored: bool = False  # a right bone seen in the z = 0 plane's mirror
    reach: float | None = None  # [m] how far below the body's origin the next joint lies for this mesh


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
        if np.linalg.norm(end - start) >= SHORTEST_ROD_M:
            yield _rod(start, end)


def _rod(start: Float[np.ndarray, "3"], end: Float[np.ndarray, "3"]) -> trimesh.Trimesh:
    length = float(np.linalg.norm(end - start))
    radius = float(np.clip(SLENDERNESS * length, THINNEST_ROD_M, THICKEST_ROD_M))
    mesh = trimesh.creation.capsule(height=max(length - 2 * radius, 0.0), radius=radius, count=[8, 8])
    mesh.apply_translation([0.0, 0.0, -0.5 * mesh.bounds.sum(axis=0)[2]])
    mesh.apply_transform(trimesh.geometry.align_vectors([0.0, 0.0, 1.0], (end - start) / length))
    mesh.apply_translation(0.5 * (start + end))
    return mesh


def stock_bones(file: str) -> tuple[StockBone, ...]:
    """The stock meshes that draw what a model's mesh file draws ("femur_r.vtp"); maybe none."""
    folder = stock_folder()
    if folder is None:
        return ()
    return tuple(bone for bone in _candidates(folder, Path(file).stem.lower()) if bone.path.is_file())


@cache
def stock_folder() -> Path | None:
    """The mesh folder of the installed `myo-sim` package, found without importing it (that needs MuJoCo)."""
    package = importlib.util.find_spec("myo_sim")
    for place in (package.submodule_search_locations if package else None) or ():
        folder = Path(place) / "models" / "meshes"
        if folder.is_dir():
            return folder
    return None


def _candidates(folder: Path, stem: str) -> tuple[StockBone, ...]:
    exact = folder / f"{stem}.stl"
    bone, left, in_arm_frame = _parsed(stem)
    if bone in _COMPOUND:
        return tuple(StockBone(folder / f"{part}.stl", Placement()) for part in _COMPOUND[bone])
    if bone in _RIGHT_LEFT:
        path = folder / f"{'l' if left else 'r'}_{bone}.stl"
        return (StockBone(path, Placement(), reach=_ANKLE_BELOW_KNEE if bone in _SHANK else None),)
    if exact.is_file():
        return (StockBone(exact, Placement()),)
    hand = _hand_bone(bone)
    if in_arm_frame and hand in _hand_offsets(folder):
        placement = _PLACEMENTS["hand"].after(_hand_offsets(folder)[hand])
        return (StockBone(folder / f"{hand}.stl", placement, left),)
    if in_arm_frame and bone in _PLACEMENTS:
        return (StockBone(folder / f"{bone}.stl", _PLACEMENTS[bone], left),)
    if bone != stem and not in_arm_frame:
        return (StockBone(folder / f"{bone}.stl", Placement(), left),)
    return ()


def _parsed(stem: str) -> tuple[str, bool, bool]:
    """Bone, whether it is the left one, whether it is a file in the frames of OpenSim's full-body arm."""
    stem = stem.removesuffix("_raja").removesuffix("_scaled")
    match = _SIDE.match(stem)
    if match is None:
        return stem, False, False
    side = match["prefix"] or match["suffix"]
    bone = _SYNONYMS.get(match["bone"], match["bone"])
    return bone, side == "l", bool(match["visible"])


def _hand_bone(bone: str) -> str:
    """Stem of the stock mesh of a hand bone; empty for another bone."""
    if bone in _CARPALS:
        return bone
    if (match := re.fullmatch(r"metacarpal([1-5])", bone)) is not None:
        return f"{match[1]}mc"
    if (match := re.fullmatch(r"(\w+)_(proximal|medial|distal)", bone)) is not None and match[1] in _FINGERS:
        return _phalanx(_FINGERS[match[1]], match[2])
    if (match := re.fullmatch(r"(prox|mid|distal)_phalanx([1-5])", bone)) is not None:
        return _phalanx(int(match[2]), match[1])
    return ""


def _phalanx(finger: int, part: str) -> str:
    return f"thumb{_PHALANX[part]}" if finger == 1 else f"{finger}{_PHALANX[part]}ph"


@cache
def _hand_offsets(folder: Path) -> dict[str, Float[np.ndarray, "3"]]:
    """Where the stock hand's bones lie with all joints at zero, in the lunate's frame [m]."""
    chain = folder.parent / "arm" / "assets" / "myoarm_r_chain.xml"
    if not chain.is_file():
        return {}
    offsets: dict[str, Float[np.ndarray, "3"]] = {}

    def walk(body: Element, offset: Float[np.ndarray, "3"]) -> None:
        for geom in body.findall("geom[@mesh]"):
            offsets[geom.get("mesh", "").removesuffix("_r")] = offset
        for child in body.findall("body"):
            walk(child, offset + np.array(child.get("pos", "0 0 0").split(), dtype=float))

    for body in ElementTree.parse(chain).iter("body"):
        if body.get("name") == "lunate_r":
            walk(body, np.zeros(3))
    return offsets


def _turned(
    scale: float, rotation_deg: tuple[float, float, float], origin: tuple[float, float, float]
) -> Placement:
    return Placement(scale, Rotation.from_rotvec(rotation_deg, degrees=True).as_matrix(), np.array(origin))


# Scale, rotation vector [deg], origin [m]. Humerus and ulna: least-squares fit of the stock surface to points
# of OpenSim's humerus_rv and ulna_rv (1.4 and 1.2 mm RMS). Radius: joint centres and pronation axes of both
# arms laid on one another; the stock arm rests with the thumb forward, OpenSim's with the palm forward. Hand:
# wrist, third metacarpal and thumb laid on one another.
_PLACEMENTS = {
    "humerus": _turned(0.974, (-2.62, 7.33, 0.51), (0.0060, -0.0043, -0.0046)),
    "ulna": _turned(0.990, (6.62, -8.13, -4.04), (-0.0052, 0.0004, 0.0026)),
    "radius": _turned(0.969, (3.78, -88.95, 1.91), (0.0, 0.0, 0.0)),
    "hand": _turned(1.0, (0.0, -90.0, 0.0), (0.005, -0.0165, -0.0065)),
}
