"""Rows of the root's residual at some frames: what they add to Gauss-Newton's system."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from solver.dynamics.trajectory.bordered_system import TrialGradient, TrialSystem
from solver.dynamics.trajectory.terms.trial_point import TrialPoint
from solver.skeleton.rotations import skew


@dataclass(frozen=True)
class ResidualRows:
    """Whitened residual rows [force, moment about the root joint's centre] and their derivatives."""

    value: Float[np.ndarray, "frames 6"]
    by_q: Float[np.ndarray, "frames 6 dofs"]
    by_v: Float[np.ndarray, "frames 6 dofs"]
    by_a: Float[np.ndarray, "frames 6 dofs"]
    by_shared: Float[np.ndarray, "frames 6 shared"]
    weights: Float[np.ndarray, "frames 6"]  # that whitened them [1/N, 1/(N·m)]; zero on frames of U
    cost: float

    @property
    def gradient_by_states(self) -> Float[np.ndarray, "3 frames dofs"]:
        """Of half the cost, by q, q̇ and q̈."""
        return np.stack([(self.value[:, None] @ J)[:, 0] for J in (self.by_q, self.by_v, self.by_a)])

    @property
    def gradient_by_shared(self) -> Float[np.ndarray, " shared"]:
        """Of half the cost, by the shared parameters."""
        return self.shared_rows.T @ self.value.ravel()

    @property
    def shared_rows(self) -> Float[np.ndarray, "rows shared"]:
        """Derivatives of all rows by the shared parameters."""
        return self.by_shared.reshape(self.value.size, self.by_shared.shape[2])

    def add_to(self, system: TrialSystem, first: int, weight: float) -> None:
        """What frames from this one on add to a trial's system, but for its gradient by states."""
        jacobians = self.by_q, self.by_v, self.by_a
        system.band.add_residual_rows(first, jacobians, self.by_shared, system.border, weight)
        system.corner += weight * self.shared_rows.T @ self.shared_rows
        system.gradient.shared += weight * self.gradient_by_shared
        system.cost += weight * self.cost

    def without(self, hidden: Bool[np.ndarray, " frames"]) -> "ResidualRows":
        """The same, zero on some frames; the cost stays that of all."""
        seen = ~hidden[:, None, None]
        return replace(
            self,
            value=self.value * seen[:, 0],
            by_q=self.by_q * seen,
            by_v=self.by_v * seen,
            by_a=self.by_a * seen,
            by_shared=self.by_shared * seen,
        )

    def with_columns(
        self,
        columns_ground: Float[np.ndarray, "frames 6 extra"],
        centre_ground: Float[np.ndarray, "frames 3"],
    ) -> "ResidualRows":
        """The same with other columns of x, the last of the shared parameters.

        Args:
            columns_ground: force [N] and moment about the ground origin [N·m] by x.
            centre_ground: of the root joint [m].
        """
        columns = -columns_ground
        columns[:, 3:] -= skew(centre_ground) @ columns[:, :3]
        inertias = self.by_shared.shape[2] - columns.shape[2]
        by_shared = np.concatenate(
            [self.by_shared[:, :, :inertias], self.weights[:, :, None] * columns], axis=2
        )
        return replace(self, by_shared=by_shared)


def add_by_states(
    at: TrialPoint, by_states: list[Float[np.ndarray, "3 some dofs"]], gradient: TrialGradient
) -> None:
    """Add the rows' gradient by q, q̇ and q̈ [half the cost], of all frames in order."""
    for order, by_state in enumerate(np.concatenate(by_states, axis=1)):
        gradient.add_frames(at.basis, at.frame_weight * by_state, order)
