"""Short weighted means over frames: what residuals are compared by; a missing frame takes no part."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int


@dataclass(frozen=True)
class Windows:
    """Hann-weighted means of `length` frames each, beginning at `start`; the weights sum to one."""

    frames: int
    start: Int[np.ndarray, " windows"]
    weights: Float[np.ndarray, " length"]

    @property
    def count(self) -> int:
        """Number of windows."""
        return len(self.start)

    @property
    def length(self) -> int:
        """Frames of one window."""
        return len(self.weights)

    @property
    def centre(self) -> Float[np.ndarray, " windows"]:
        """Middle frame of each window."""
        return self.start + (self.length - 1) / 2

    def means(self, values: Float[np.ndarray, "frames *columns"]) -> Float[np.ndarray, "windows *columns"]:
        """Weighted means of frame-by-frame values."""
        out = np.zeros((self.count, *values.shape[1:]))
        for k, weight in enumerate(self.weights):
            out += weight * values[self.start + k]
        return out


def windows_over(counts: Bool[np.ndarray, " frames"], rate: float, length_s: float, hop_s: float) -> Windows:
    """Windows on a regular grid, without those that touch a frame that does not count.

    Args:
        counts: frames that may be used.
        rate: of the frames [Hz].
        length_s: of a window [s].
        hop_s: from one window to the next [s].
    """
    hop = max(1, round(hop_s * rate))
    length = max(1, round(length_s * rate))
    length += 1 - length % 2
    start = np.arange(0, len(counts) - length + 1, hop)
    missing = np.concatenate([[0], np.cumsum(~counts)])
    whole = missing[start + length] == missing[start]
    shape = np.hanning(length + 2)[1:-1]
    return Windows(len(counts), start[whole], shape / shape.sum())
