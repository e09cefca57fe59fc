"""What the centre-of-mass trajectory is fitted to."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from solver.common.errors import FitError
from solver.contact.wrenches import ContactWrenches, FrameMask
from solver.dynamics.root_wrench import centre_of_mass_of
from solver.kinematics.motion import Motion
from solver.skeleton.skeleton import Skeleton


@dataclass(frozen=True)
class ComData:
    """One trial seen as a point mass.

    `observed` is the complement of the paper's U; on other frames the force means nothing.
    """

    com_ground: Float[np.ndarray, "frames 3"]  # [m] from the markers
    force_ground: Float[np.ndarray, "frames 3"]  # [N] of all feet together
    observed: Bool[np.ndarray, " frames"]
    rate: float  # [Hz]
    gravity: Float[np.ndarray, "3"]  # [m/s²]

    @property
    def frames(self) -> int:
        """Number of frames."""
        return self.com_ground.shape[0]

    def without(self, hidden: Bool[np.ndarray, " frames"]) -> "ComData":
        """The same trial with further frames unobserved."""
        return replace(self, observed=self.observed & ~hidden)

    def between(self, start: int, end: int) -> "ComData":
        """Frames `start` to `end` (excluded) as a trial of their own."""
        part = slice(start, end)
        return replace(
            self,
            com_ground=self.com_ground[part],
            force_ground=self.force_ground[part],
            observed=self.observed[part],
        )


def com_data(skeleton: Skeleton, motion: Motion, contacts: ContactWrenches, mask: FrameMask) -> ComData:
    """Centre of mass of a motion beside the forces that were measured.

    Args:
        skeleton: scaled; only the shares of the segments' masses matter.
        motion: as the kinematics fitted it; filtering is up to the caller.
        contacts: at the motion's frames.
        mask: which feet's forces count.

    Raises:
        FitError: motion, forces and mask are not of the same frames.
    """
    if not motion.frames == contacts.frames == len(mask.counts):
        raise FitError(
            f"Motion has {motion.frames} frames, forces {contacts.frames} and the mask {len(mask.counts)}; "
            "they must be of the same trial at the markers' frames."
        )
    return ComData(
        com_ground=centre_of_mass_of(skeleton, motion.q),
        force_ground=contacts.wrench_ground[:, :, :3].sum(axis=1),
        observed=contacts.observed & mask.all_feet,
        rate=motion.rate,
        gravity=np.asarray(skeleton.gravity, dtype=float),
    )
