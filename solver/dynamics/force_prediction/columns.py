"""Wrenches that a prediction fit may add to the plates', each with a parameter that all trials share."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True)
class Columns:
    """Of one kind and one trial: force [N] and moment about the ground origin [N·m] per parameter."""

    kind: str
    ground: Float[np.ndarray, "frames 6 n"]
    prior_std: Float[np.ndarray, " n"]
