"""Quantities seen from the root body: its frame's axes, and its origin."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from solver.skeleton.forward import cross

HISTORY_ENTRIES = 10  # the present frame and nine earlier ones: what models of the dataset are fed with
HISTORY_STRIDE = 3  # frames from one to the next; likewise


@dataclass(frozen=True)
class RootFrame:
    """The root body's pose over time."""

    R_ground_root: Float[np.ndarray, "frames 3 3"]
    p_ground_root: Float[np.ndarray, "frames 3"]  # [m]

    def vectors(self, ground: Float[np.ndarray, "frames *n 3"]) -> Float[np.ndarray, "frames *n 3"]:
        """Directions: the root's velocity and place don't enter."""
        return np.einsum("tji,t...j->t...i", self.R_ground_root, ground)

    def points(self, ground: Float[np.ndarray, "frames *n 3"]) -> Float[np.ndarray, "frames *n 3"]:
        """Places [m]."""
        between = (slice(None), *(None,) * (ground.ndim - 2))
        return self.vectors(ground - self.p_ground_root[between])

    def wrench(
        self, moment_ground: Float[np.ndarray, "frames 3"], force_ground: Float[np.ndarray, "frames 3"]
    ) -> Float[np.ndarray, "frames 6"]:
        """[moment about the root's origin, force] from the moment about the ground origin [N·m, N]."""
        moment = moment_ground - cross(self.p_ground_root, force_ground)
        return np.hstack([self.vectors(moment), self.vectors(force_ground)])

    def history(self) -> tuple[Float[np.ndarray, "frames entries 3"], Float[np.ndarray, "frames entries 3"]]:
        """Where the root was: origin [m] and body-fixed XYZ angles [rad], in its present frame.

        The first entry is the present; entries from before the trial are zero.
        """
        frames = len(self.p_ground_root)
        places, angles = np.zeros((2, frames, HISTORY_ENTRIES, 3))
        for entry in range(HISTORY_ENTRIES):
            now = np.arange(entry * HISTORY_STRIDE, frames)
            if not len(now):
                break
            then = now - entry * HISTORY_STRIDE
            back = self.R_ground_root[now].transpose(0, 2, 1)
            offset = self.p_ground_root[then] - self.p_ground_root[now]
            places[now, entry] = (back @ offset[..., None])[..., 0]
            angles[now, entry] = Rotation.from_matrix(back @ self.R_ground_root[then]).as_euler("XYZ")
        return places, angles
