"""Parameters that the trials of a subject share: φ of the inertias, x of the extra columns."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from solver.dynamics.inertia_parameters import InertiaParameters
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.skeleton import Skeleton


@dataclass(frozen=True, eq=False)
class SharedParameters:
    """Their values at one iterate, and what is made of them once for all terms.

    As a vector: φ, where it is free, and x, one after the other.
    """

    inertias: InertiaParameters
    phi: Float[np.ndarray, " parameters"]
    x: Float[np.ndarray, " extra"]
    inertias_free: bool

    @property
    def free_inertias(self) -> int:
        """How many of φ are free."""
        return self.inertias.count if self.inertias_free else 0

    @property
    def count(self) -> int:
        """How many there are."""
        return self.free_inertias + len(self.x)

    def moved(self, step: Float[np.ndarray, " shared"]) -> "SharedParameters":
        """After a step that was found by the derivatives here."""
        free, phi = self.free_inertias, self.phi
        if free:
            phi = self.inertias.moved(phi, step[:free])
        return replace(self, phi=phi, x=self.x + step[free:])

    @cached_property
    def skeleton(self) -> Skeleton:
        """With the inertias of φ."""
        return self.inertias.skeleton_at(self.phi)

    @cached_property
    def rigid_bodies(self) -> RigidBodyModel:
        """Made of that skeleton."""
        return RigidBodyModel(self.skeleton)

    @cached_property
    def pseudo_inertias(self) -> Float[np.ndarray, "bodies 4 4"]:
        """J of every body [kg, kg·m, kg·m²]."""
        return self.inertias.pseudo_inertias(self.phi)

    @cached_property
    def by_phi(self) -> Float[np.ndarray, "bodies 10 4 4"]:
        """∂J/∂φ of every body by its group's ten parameters."""
        return self.inertias.derivatives(self.phi)
