"""How far two reviewers agree on which forces are missing: Cohen's kappa, and where they differ."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from annotations.runs import true_runs


@dataclass(frozen=True)
class Agreement:
    """Two reviewers' labels of the same frames and feet, compared."""

    kappa: float  # 1: the same; 0: as much as chance would; NaN: both gave all the same one label
    same: float  # share of labels that are the same
    differ: tuple[tuple[int, int], ...]  # ranges of frames on which some foot's labels differ


def agreement(one: Bool[np.ndarray, "frames feet"], other: Bool[np.ndarray, "frames feet"]) -> Agreement:
    """Compare two reviews of a trial.

    Args:
        one: true where the first reviewer says that the force is missing.
        other: likewise the second.

    Source: Cohen 1960, 10.1177/001316446002000104.
    """
    same = float(np.mean(one == other))
    p, q = float(np.mean(one)), float(np.mean(other))
    by_chance = p * q + (1 - p) * (1 - q)
    kappa = (same - by_chance) / (1 - by_chance) if by_chance < 1 else float("nan")
    apart = np.any(one != other, axis=1)
    return Agreement(kappa, same, tuple(true_runs(apart)))
