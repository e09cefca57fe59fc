"""Forces held out from the fit and then predicted: the figure that a fit cannot buy by bending the motion."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.common.true_runs import runs


@dataclass(frozen=True)
class HeldOut:
    """Residuals [N, N·m about the root joint's centre] of a fit judged on forces as if it had not seen them.

    `frames` are those that count: held out, and not at the trial's ends. The first residual is of what would
    stand for missing forces: with learnt terms, where these are on.
    """

    frames: Bool[np.ndarray, " frames"]
    residual_root: Float[np.ndarray, "frames 6"]
    kinematics_only_root: Float[np.ndarray, "frames 6"]  # of the markers' motion at `markers_hz`
    markers_hz: tuple[float, float]  # cut-offs of the markers' motion for force and moment
    motion_only_root: Float[np.ndarray, "frames 6"] | None = None  # of the fit's own motion; None: the same
    learnt: tuple[str, ...] = ()  # kinds of terms that predict hidden blocks better


@dataclass(frozen=True)
class HeldOutBlocks:
    """What was missed on each held-out block or step of a trial that has frames that count."""

    ranges: Int[np.ndarray, "blocks 2"]  # frames
    frames: Int[np.ndarray, " blocks"]  # of them that count
    missed: Float[np.ndarray, "blocks 2"]  # sums over these of squared forces [N²] and moments [N²·m²]
    markers_missed: Float[np.ndarray, "blocks 2"]  # by the markers alone at their best cut-off elsewhere
    markers_hz: tuple[float, float]  # for force and moment
    products: Float[np.ndarray, "blocks 6 6"] | None = None  # sums of e eᵀ of what was missed; None: older

    def without(self, frames: Int[np.ndarray, " some"]) -> "HeldOutBlocks":
        """The blocks that hold none of these frames."""
        starts, ends = np.searchsorted(frames, self.ranges.T)
        left = starts == ends
        return replace(
            self,
            ranges=self.ranges[left],
            frames=self.frames[left],
            missed=self.missed[left],
            markers_missed=self.markers_missed[left],
            products=None if self.products is None else self.products[left],
        )


@dataclass(frozen=True)
class HeldOutLayout:
    """One layout of blocks or steps, judged as if the fit had seen none of their forces."""

    kind: str
    number: int
    trials: Mapping[str, HeldOutBlocks] = field(default_factory=dict)  # those with anything held out
    learnt: tuple[str, ...] | None = None  # kinds of terms that predicted them; None: an older version's


def judged_blocks(
    held_out: HeldOut, frames: Bool[np.ndarray, " frames"], first_frame: int = 0
) -> HeldOutBlocks | None:
    """A layout's figures, block by block; None where no frame counts.

    Args:
        held_out: of the same layout.
        frames: of the layout.
        first_frame: how the recording counts the first of these.
    """
    kept = [run for run in runs(frames) if held_out.frames[slice(*run)].any()]
    if not kept:
        return None
    return HeldOutBlocks(
        np.array(kept) + first_frame,
        np.array([held_out.frames[slice(*run)].sum() for run in kept]),
        np.array([_squares(held_out.residual_root, held_out.frames, run) for run in kept]),
        np.array([_squares(held_out.kinematics_only_root, held_out.frames, run) for run in kept]),
        held_out.markers_hz,
        np.array([_products(held_out, run) for run in kept]),
    )


def _products(held_out: HeldOut, run: tuple[int, int]) -> Float[np.ndarray, "6 6"]:
    rows = held_out.residual_root[slice(*run)][held_out.frames[slice(*run)]]
    return rows.T @ rows


def _squares(
    residual: Float[np.ndarray, "frames 6"], counts: Bool[np.ndarray, " frames"], run: tuple[int, int]
) -> list[float]:
    rows = residual[slice(*run)][counts[slice(*run)]]
    return [float(np.sum(rows[:, :3] ** 2)), float(np.sum(rows[:, 3:] ** 2))]
