"""What trials give to the trajectory fit: measurements, and what else may act on the body."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from solver.kinematics.motion import Motion


@dataclass(frozen=True)
class TrialData:
    """What one trial gives to the fit; everything at the markers' frames."""

    observed_ground: Float[np.ndarray, "frames markers 3"]  # [m] NaN where unseen; the skeleton's markers
    wrench_ground: Float[np.ndarray, "frames 6"]  # [N, N·m about the ground origin] of all feet together
    counts: Bool[np.ndarray, " frames"]  # False on frames of U
    start: Motion  # the marker fit
    initial: Motion | None = None  # where the search begins; None: at the marker fit
    spline: Float[np.ndarray, "coefficients dofs"] | None = None  # of an earlier fit: begin there instead
    other_start: Motion | None = None  # begin here instead, where the cost is lower than there
    foretold_ground: Float[np.ndarray, "frames 6"] | None = (
        None  # like the wrench, for frames of U; None: free
    )
    extra_wrench_ground: Float[np.ndarray, "frames 6"] | None = None  # acts beside the feet's; None: nothing
    extra_columns_ground: Float[np.ndarray, "frames 6 extra"] | None = None  # likewise per x; None: zero


@dataclass(frozen=True)
class ExtraParameters:
    """x of the trials' extra columns: scatter before the data, and where the search begins."""

    prior_std: Float[np.ndarray, " extra"]
    start: Float[np.ndarray, " extra"]

    @classmethod
    def none(cls) -> "ExtraParameters":
        """Nothing extra."""
        return cls(np.zeros(0), np.zeros(0))
