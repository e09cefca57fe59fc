"""Series of numbers as text that the page's script reads: whole steps, differences, deflated.

The script's `unpacked` (player.js) is the other half.
"""

import base64
import zlib
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

UNKNOWN = -32768  # stands for NaN
LARGEST = 32767  # steps either way


@dataclass(frozen=True)
class Packed:
    """A series of numbers; `unpacked` gives them back to half a step."""

    width: int  # numbers a frame
    step: float
    offset: float
    data: str  # base64 of zlib of all low bytes, then all high bytes, of 16-bit differences along time

    def as_json(self) -> dict[str, object]:
        """Plain values."""
        return {"width": self.width, "step": self.step, "offset": self.offset, "data": self.data}


def packed(values: Float[np.ndarray, "frames *rest"], step: float) -> Packed:
    """Round to steps; a larger step where so many of them would not reach.

    Args:
        values: any; NaN where unknown.
        step: the finest that is wanted, in the unit of the values.
    """
    flat = values.reshape(len(values), -1)
    known = np.isfinite(flat)
    low, high = (float(flat[known].min()), float(flat[known].max())) if known.any() else (0.0, 0.0)
    step = max(step, 0.5 * (high - low) / (LARGEST - 1))
    offset = step * np.floor(0.5 * (low + high) / step)  # a whole step, so that whole numbers stay exact
    whole = np.where(known, np.rint((np.where(known, flat, offset) - offset) / step), UNKNOWN)
    by_column = whole.astype(np.int64).T
    difference = np.diff(by_column, axis=1, prepend=0).astype(np.uint64).astype(np.uint16).ravel()
    planes = np.concatenate([difference & 0xFF, difference >> 8]).astype(np.uint8)
    data = base64.b64encode(zlib.compress(planes.tobytes(), 9)).decode()
    return Packed(flat.shape[1], step, float(offset), data)


def unpacked(series: Packed, frames: int) -> Float[np.ndarray, "frames width"]:
    """The numbers again, as the script has them."""
    planes = np.frombuffer(zlib.decompress(base64.b64decode(series.data)), dtype=np.uint8).astype(np.uint16)
    low, high = planes.reshape(2, series.width, frames)
    whole = np.cumsum(low | (high << 8), axis=1, dtype=np.uint16).astype(np.int16)
    values = np.where(whole == UNKNOWN, np.nan, whole * series.step + series.offset)
    return values.T
