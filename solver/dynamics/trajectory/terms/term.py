"""What a term of the trajectory fit gives: its cost, its gradient, and its share of the Gauss-Newton system.

The fit knows terms by these protocols alone. Two kinds: of one trial, by its spline's coefficients and the
shared parameters; and of the shared parameters alone, which are priors. Gradients and systems are of half the
cost, so that rows R with derivatives J give Jᵀ R and Jᵀ J. A `TrialPoint` is where they are asked.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import Protocol

import numpy as np
from jaxtyping import Float, Int

from solver.dynamics.inertia_parameters import InertiaParameters
from solver.dynamics.trajectory.bordered_system import TrialGradient, TrialSystem
from solver.dynamics.trajectory.spline_basis import SplineBasis
from solver.skeleton.forward import ForwardKinematics, Poses
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.skeleton import Skeleton

REFERENCE_RATE_HZ = 100.0  # the weights of single frames are stated for it
CHUNK = 128  # frames whose poses and rows are worked out together: they stay in the processor's cache


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
        if not len(step):
            return self
        free, phi = self.free_inertias, self.phi
        if free:
            phi = self.inertias.moved(phi, step[:free], self.pseudo_inertias, self.by_phi)
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


@dataclass(frozen=True)
class FrameStates:
    """Neighbouring frames of a trial: q, q̇, q̈ and where everything is."""

    frames: slice  # of the trial
    q: Float[np.ndarray, "some dofs"]
    v: Float[np.ndarray, "some dofs"]
    a: Float[np.ndarray, "some dofs"]
    kinematics: ForwardKinematics
    poses: Poses

    def only(self, some: Int[np.ndarray, " fewer"]) -> "FrameStates":
        """Those of these frames, counted from the first one here; they need not be neighbours any more."""
        if len(some) == len(self.q):
            return self
        p = self.poses
        poses = Poses(
            p.R_ground_body[some],
            p.p_ground_body[some],
            p.angular_ground[some],
            p.linear_ground[some],
            p.slope[some],
        )
        return FrameStates(self.frames, self.q[some], self.v[some], self.a[some], self.kinematics, poses)


@dataclass(frozen=True, eq=False)
class TrialPoint:
    """One trial at one iterate. The spline's first columns are the dofs; behind them may stand others.

    Poses are worked out once, when the first term asks for them, and kept as long as this is.
    """

    basis: SplineBasis
    kinematics: ForwardKinematics
    coefficients: Float[np.ndarray, "coefficients columns"]
    shared: SharedParameters

    @property
    def frame_weight(self) -> float:
        """Of a frame in a sum over frames: a trial of twice the rate has as much to say."""
        return REFERENCE_RATE_HZ / self.basis.rate

    @cached_property
    def q(self) -> Float[np.ndarray, "frames dofs"]:
        """At the frames [rad or m]."""
        return self._evaluated(0)

    @cached_property
    def chunks(self) -> tuple[FrameStates, ...]:
        """All frames, chunk by chunk, each from a piece's first frame on."""
        v, a = self._evaluated(1), self._evaluated(2)
        chunk = max(1, CHUNK // self.basis.spacing) * self.basis.spacing
        last = max(1, (len(v) - 1) // chunk)  # the trial's last frame may be all that is left of a piece
        edges = [chunk * i for i in range(last)] + [len(v)]
        spans = [slice(low, high) for low, high in pairwise(edges)]
        return tuple(
            FrameStates(s, self.q[s], v[s], a[s], self.kinematics, self.kinematics.poses(self.q[s]))
            for s in spans
        )

    def _evaluated(self, order: int) -> Float[np.ndarray, "frames dofs"]:
        return self.basis.evaluate(self.coefficients[:, : self.kinematics.chain.dofs], order)


class Term(Protocol):
    """A summand of one trial's cost, over all its frames.

    Made once a fit, of the trial's data and the settings; what it holds does not change afterwards. It adds
    to what is handed to it, and leaves alone what other terms have added there.
    """

    def cost(self, at: TrialPoint) -> float:
        """Whole, not half."""
        ...

    def add_gradient(self, at: TrialPoint, gradient: TrialGradient) -> None:
        """That of half the cost, exactly, and the cost, at a fraction of the system's price."""
        ...

    def add_linearized(self, at: TrialPoint, system: TrialSystem) -> None:
        """The same gradient, the cost, and Gauss-Newton's matrix, which is positive semidefinite."""
        ...


class SharedTerm(Protocol):
    """A summand of the subject's cost that depends on the shared parameters alone."""

    def cost(self, shared: SharedParameters) -> float:
        """Whole, not half."""
        ...

    def gradient(self, shared: SharedParameters) -> Float[np.ndarray, " shared"]:
        """Of half the cost."""
        ...

    def curvature(self, shared: SharedParameters) -> Float[np.ndarray, "shared shared"]:
        """Gauss-Newton's, of half the cost."""
        ...
