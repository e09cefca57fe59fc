"""Some frames of a trial as a trajectory has them: q, q̇, q̈ and where everything is."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from solver.skeleton.forward import ForwardKinematics, Poses


@dataclass(frozen=True)
class TrialStates:
    """States of neighbouring frames, and the poses that all terms of these frames share."""

    frames: slice  # of the trial
    q: Float[np.ndarray, "some dofs"]
    v: Float[np.ndarray, "some dofs"]
    a: Float[np.ndarray, "some dofs"]
    kinematics: ForwardKinematics
    poses: Poses

    def only(self, some: Int[np.ndarray, " fewer"]) -> "TrialStates":
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
        return TrialStates(self.frames, self.q[some], self.v[some], self.a[some], self.kinematics, poses)
