"""Where the fit is: one trial's spline and the shared parameters, with the poses that terms share."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int

from solver.dynamics.trajectory.spline_basis import SplineBasis
from solver.dynamics.trajectory.terms.shared_parameters import SharedParameters
from solver.skeleton.forward import ForwardKinematics, Poses

REFERENCE_RATE_HZ = 100.0  # the weights of single frames are stated for it
CHUNK = 128  # frames whose poses and rows are worked out together: they stay in the processor's cache


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
