"""How far the fitted skeleton's markers lie from the measured ones."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True)
class MarkerErrors:
    """Distance of each model marker from the raw measured one [m], NaN where unseen."""

    names: tuple[str, ...]  # markers that model and recording share
    distance: Float[np.ndarray, "frames markers"]  # [m]

    @property
    def rms(self) -> float:
        """Root mean square over all seen marker-frames [m]."""
        return float(np.sqrt(np.nanmean(self.distance**2)))

    @property
    def rms_per_frame(self) -> Float[np.ndarray, " frames"]:
        """Root mean square over the markers of each frame [m]; NaN on frames without any."""
        seen = np.isfinite(self.distance)
        squares = np.where(seen, self.distance, 0.0) ** 2
        with np.errstate(invalid="ignore"):
            return np.sqrt(squares.sum(axis=1) / seen.sum(axis=1))

    @property
    def rms_frame_mean(self) -> float:
        """Mean over frames of the per-frame RMS, as peers print it [m]."""
        return float(np.nanmean(self.rms_per_frame))

    @property
    def maximum(self) -> float:
        """Largest distance of all marker-frames [m]."""
        return float(np.nanmax(self.distance))
