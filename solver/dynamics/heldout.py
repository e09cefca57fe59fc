"""Forces withheld from the fit and then predicted: the figure that a fit cannot buy by bending the motion."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from solver.dynamics.trajectory_settings import TrajectorySettings


@dataclass(frozen=True)
class Heldout:
    """Residuals [N, N·m about the root joint's centre] of a fit that never saw the withheld frames' forces.

    `frames` are those that count: withheld, and not at the trial's ends. The first residual is of what would
    stand for missing forces: with learnt terms, where these are on.
    """

    frames: Bool[np.ndarray, " frames"]
    residual_root: Float[np.ndarray, "frames 6"]
    kinematics_only_root: Float[np.ndarray, "frames 6"]  # of the markers' motion, through the forces' filter
    motion_only_root: Float[np.ndarray, "frames 6"] | None = None  # of the fit's own motion; None: the same
    learnt: tuple[str, ...] = ()  # kinds of terms that foretell hidden blocks better


def withheld_frames(
    counts: Bool[np.ndarray, " frames"], rate: float, settings: TrajectorySettings
) -> Bool[np.ndarray, " frames"]:
    """Every k-th block of frames with known forces, never the first nor the last one.

    Whole blocks, because a frame's neighbours know its force; a block is as long as a step's half.

    Args:
        counts: frames whose forces are known.
        rate: [Hz].
        settings: length and distance of the blocks.
    """
    withheld = np.zeros(len(counts), dtype=bool)
    known = np.flatnonzero(counts)
    length = max(1, round(settings.heldout_block_s * rate))
    for start in range(length, len(known) - 2 * length + 1, settings.heldout_every * length):
        withheld[known[start : start + length]] = True
    return withheld
