"""What a prediction fit learnt: where the next one, of nearly the same frames, begins."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True)
class LearntTerms:
    """Beside its trajectories."""

    kinds: tuple[str, ...]  # that predicted hidden blocks better
    phi: Float[np.ndarray, " parameters"]  # the prediction fit's inertias
    x: Float[np.ndarray, " extra"]  # of an extension's columns, then of these kinds'
    peak_N: float = 0.0  # of the force that stepping demands, which step curves are in proportion to
