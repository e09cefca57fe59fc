"""Mass, centre of mass and inertia of rigid parts and of their sum."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from solver.skeleton.rotations import rotation_about, skew
from solver.skeleton.segment_tables import SegmentShape


@dataclass(frozen=True)
class MassElement:
    """A rigid part in the frame of one body. Inertia is about the centre of mass."""

    mass: float  # [kg]
    com: Float[np.ndarray, "3"]  # [m]
    inertia: Float[np.ndarray, "3 3"]  # [kg·m²]

    def inertia_about(self, point: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
        """Inertia about another point (Huygens-Steiner) [kg·m²]."""
        offset = skew(self.com - point)
        return self.inertia - self.mass * offset @ offset

    def moved(self, by: Float[np.ndarray, "3"]) -> "MassElement":
        """The same part elsewhere."""
        return replace(self, com=self.com + by)


def segment_element(
    shape: SegmentShape, body_mass: float, start: Float[np.ndarray, "3"], end: Float[np.ndarray, "3"]
) -> MassElement:
    """A segment of the tables laid between its end points.

    Its long axis is y, turned to the line between the points by the least rotation.

    Args:
        shape: a row of the table.
        body_mass: of the whole person [kg].
        start: the end point that the centre of mass counts from [m].
        end: the other [m].
    """
    along = end - start
    length = float(np.linalg.norm(along))
    mass = shape.mass * body_mass
    radii = length * np.array([shape.radius_sagittal, shape.radius_longitudinal, shape.radius_transverse])
    R = _least_rotation(np.array([0.0, np.sign(along[1]), 0.0]), along / length)
    return MassElement(mass, start + shape.com * along, R @ np.diag(mass * radii**2) @ R.T)


def ellipsoid(mass: float, com: Float[np.ndarray, "3"], half_axes: Float[np.ndarray, "3"]) -> MassElement:
    """A solid ellipsoid along the body's axes."""
    squares = half_axes**2
    return MassElement(mass, com, np.diag(mass / 5 * (squares.sum() - squares)))


def box(mass: float, com: Float[np.ndarray, "3"], edges: Float[np.ndarray, "3"]) -> MassElement:
    """A solid cuboid along the body's axes."""
    squares = edges**2
    return MassElement(mass, com, np.diag(mass / 12 * (squares.sum() - squares)))


def together(parts: Sequence[MassElement]) -> MassElement:
    """Rigidly joined parts as one."""
    mass = sum(part.mass for part in parts)
    com = sum((part.mass * part.com for part in parts), np.zeros(3)) / mass
    return MassElement(mass, com, sum((part.inertia_about(com) for part in parts), np.zeros((3, 3))))


def without(whole: MassElement, parts: Sequence[MassElement]) -> MassElement:
    """What is left of a whole when parts of it become bodies of their own."""
    return together([whole, *(MassElement(-part.mass, part.com, -part.inertia) for part in parts)])


def _least_rotation(a: Float[np.ndarray, "3"], b: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3 3"]:
    """The rotation by the least angle that takes unit vector a to unit vector b."""
    axis = np.cross(a, b)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-12:
        return np.eye(3)
    return rotation_about(axis / sine, np.array([np.arctan2(sine, a @ b)]))[0]
