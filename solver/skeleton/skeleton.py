"""The skeleton: kinematic tree, inertias and marker set at a given scale. Immutable."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np
from jaxtyping import Float

from solver.common.errors import ModelError
from solver.common.notes import Note
from solver.skeleton.functions import ScalarFunction


@dataclass(frozen=True)
class Geometry:
    """One mesh that draws a body; `file` is the model's own name for it ("femur.vtp")."""

    file: str
    scale: Float[np.ndarray, "3"]
    R_body_mesh: Float[np.ndarray, "3 3"]
    p_body_mesh: Float[np.ndarray, "3"]  # [m]


@dataclass(frozen=True)
class Body:
    """A rigid segment. Inertia is about the centre of mass, axes of the body frame."""

    name: str
    mass: float  # [kg]
    com_body: Float[np.ndarray, "3"]  # [m]
    inertia_body: Float[np.ndarray, "3 3"]  # [kg·m²]
    geometry: tuple[Geometry, ...] = ()
    scale: Float[np.ndarray, "3"] = field(default_factory=lambda: np.ones(3))  # relative to the model file


@dataclass(frozen=True)
class Axis:
    """One degree of motion inside a joint: displacement = function(coordinate) about or along `axis`.

    `coordinate` None means the displacement is constant.
    """

    kind: Literal["rotation", "translation"]
    axis: Float[np.ndarray, "3"]
    function: ScalarFunction
    coordinate: str | None


@dataclass(frozen=True)
class Joint:
    """Carries body i: T_parent_child = T_parent_frame · translations · rotations · T_child_frame⁻¹."""

    name: str
    parent: int  # index of the parent body; -1 is the ground
    R_parent_frame: Float[np.ndarray, "3 3"]
    p_parent_frame: Float[np.ndarray, "3"]  # [m]
    R_child_frame: Float[np.ndarray, "3 3"]
    p_child_frame: Float[np.ndarray, "3"]  # [m]
    axes: tuple[Axis, ...]  # translations first (axes fixed in the parent frame), then rotations in order


@dataclass(frozen=True)
class Coordinate:
    """A coordinate of the model file, in the file's order.

    Free ones make up q. A locked one stays at `default`; a coupled one is `coupling(free coordinate)`.
    """

    name: str
    motion: Literal["rotation", "translation", "coupled"]
    default: float
    range: tuple[float, float]
    clamped: bool = False
    locked: bool = False
    coupling: ScalarFunction | None = None
    coupled_to: str | None = None

    @property
    def free(self) -> bool:
        """Whether it is one of the generalized coordinates q."""
        return not self.locked and self.coupling is None


@dataclass(frozen=True)
class Marker:
    """A model marker, fixed on a body. `fixed` is the file's flag: placed on a bony landmark."""

    name: str
    body: int
    position_body: Float[np.ndarray, "3"]  # [m]
    fixed: bool = False
    spread_m: float | None = None  # how far a person's may lie from there; None: by flag and name


@dataclass(frozen=True)
class Skeleton:
    """Bodies in topological order (a parent before its children); body i hangs on joint i."""

    name: str
    bodies: tuple[Body, ...]
    joints: tuple[Joint, ...]
    coordinates: tuple[Coordinate, ...]
    markers: tuple[Marker, ...]
    gravity: Float[np.ndarray, "3"] = field(default_factory=lambda: np.array([0.0, -9.80665, 0.0]))  # [m/s²]
    notes: tuple[Note, ...] = ()  # what the reader ignored or assumed

    @cached_property
    def dofs(self) -> tuple[str, ...]:
        """Names of the generalized coordinates q: the free coordinates in the file's order."""
        return tuple(c.name for c in self.coordinates if c.free)

    @cached_property
    def free_coordinates(self) -> tuple[Coordinate, ...]:
        """The coordinates that q holds."""
        return tuple(c for c in self.coordinates if c.free)

    @cached_property
    def default_q(self) -> Float[np.ndarray, " dofs"]:
        """The model file's default pose [rad or m]."""
        return np.array([c.default for c in self.free_coordinates])

    @cached_property
    def mass(self) -> float:
        """Total mass [kg]."""
        return float(sum(b.mass for b in self.bodies))

    def bodies_from_share(self, share: float) -> tuple[int, ...]:
        """Indices of the bodies that have at least this share of the total mass."""
        return tuple(b for b, body in enumerate(self.bodies) if body.mass >= share * self.mass)

    @cached_property
    def body_names(self) -> tuple[str, ...]:
        """Names of the bodies in topological order."""
        return tuple(b.name for b in self.bodies)

    @cached_property
    def marker_names(self) -> tuple[str, ...]:
        """Names of the model markers."""
        return tuple(m.name for m in self.markers)

    def body_index(self, name: str) -> int:
        """Index of a body; names the choices when there is none."""
        if name not in self.body_names:
            raise ModelError(f"{self.name}: no body '{name}'; bodies: {', '.join(self.body_names)}.")
        return self.body_names.index(name)

    def with_markers(self, markers: Sequence[Marker]) -> "Skeleton":
        """The same skeleton with another marker set."""
        return replace(self, markers=tuple(markers))
