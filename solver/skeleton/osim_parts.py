"""What both layouts of OpenSim files boil down to, before it becomes a skeleton."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.common.notes import Note
from solver.skeleton.osim_document import Node, OsimDocument
from solver.skeleton.rotations import body_fixed_xyz
from solver.skeleton.skeleton import Body, Geometry

GROUND = "ground"
ROUNDING = 1e-6  # of the largest moment; files print as few as six digits


@dataclass(frozen=True)
class Placement:
    """A frame fixed on a body; `body` is "ground" for one that never moves."""

    body: str
    R: Float[np.ndarray, "3 3"]
    p: Float[np.ndarray, "3"]  # [m]

    def offset(self, translation: Float[np.ndarray, "3"], orientation: Float[np.ndarray, "3"]) -> "Placement":
        """The frame at that place in this one: translation [m], then body-fixed x-y-z angles [rad]."""
        return Placement(self.body, self.R @ body_fixed_xyz(orientation), self.p + self.R @ translation)


def origin(body: str) -> Placement:
    """A body's own frame."""
    return Placement(body, np.eye(3), np.zeros(3))


@dataclass(frozen=True)
class JointPart:
    """A joint element, the frames it connects, and its coordinate elements in the file's order."""

    node: Node
    name: str
    parent: Placement
    child: Placement
    coordinates: tuple[Node, ...]


@dataclass(frozen=True)
class MarkerPart:
    """A marker element and the frame that carries it."""

    node: Node
    frame: Placement


@dataclass(frozen=True)
class ModelParts:
    """Bodies without the ground, and joints in the order in which OpenSim lists their coordinates."""

    bodies: tuple[Body, ...]
    joints: tuple[JointPart, ...]
    markers: tuple[MarkerPart, ...]
    notes: tuple[Note, ...] = ()


def body_of(
    document: OsimDocument, node: Node, inertia: Float[np.ndarray, "6"], geometry: tuple[Geometry, ...]
) -> Body:
    """A body from its element, its inertia xx yy zz xy xz yz about the centre of mass [kg·m²], and meshes."""
    mass = document.number(node, "mass")
    if mass < 0:
        raise document.error(node, f"its mass is {mass:g} kg; masses are zero or positive.")
    xx, yy, zz, xy, xz, yz = inertia if mass > 0 else np.zeros(6)
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if np.diag(tensor).min() < 0 or np.linalg.eigvalsh(tensor)[0] < -ROUNDING * np.abs(tensor).max():
        raise document.error(
            node, "its inertia has a negative principal moment; correct its moments and products."
        )
    return Body(
        name=required_name(document, node),
        mass=mass,
        com_body=document.numbers(node, "mass_center", 3, default=(0.0, 0.0, 0.0)),
        inertia_body=tensor,
        geometry=geometry,
    )


def required_name(document: OsimDocument, node: Node) -> str:
    """The element's name attribute."""
    name = node.get("name", "")
    if not name:
        raise document.error(node, "it has no name; give it a name attribute.")
    return name
