"""How far two reviewers agree, on missing forces or on activities: Cohen's kappa, and where they differ."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Shaped

from annotations.label_runs import true_runs


@dataclass(frozen=True)
class Agreement:
    """Two reviewers' labels of the same frames and feet, compared."""

    kappa: float  # 1: the same; 0: as much as chance would; NaN: both gave all the same one label
    same: float  # share of labels that are the same
    differ: tuple[tuple[int, int], ...]  # ranges of frames on which some foot's labels differ


def agreement(
    one: Shaped[np.ndarray, "frames lanes"], other: Shaped[np.ndarray, "frames lanes"]
) -> Agreement:
    """Compare two reviews of a trial.

    Args:
        one: the first reviewer's labels of any kind: whether a force is missing, or the activity's name.
        other: likewise the second's.

    Source: Cohen 1960, 10.1177/001316446002000104.
    """
    same = float(np.mean(one == other))
    by_chance = sum(float(np.mean(one == label) * np.mean(other == label)) for label in np.unique(one))
    kappa = (same - by_chance) / (1 - by_chance) if by_chance < 1 else float("nan")
    return Agreement(kappa, same, tuple(true_runs(np.any(one != other, axis=1))))
