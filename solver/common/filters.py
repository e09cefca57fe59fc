"""The one low-pass that kinematics and forces share."""

from functools import lru_cache

import numpy as np
from jaxtyping import Float

ORDER = 3  # of the single pass: as in the supplement of the paper on the dataset


def low_pass(
    values: Float[np.ndarray, "samples *columns"], rate: float, cutoff_Hz: float, order: int = ORDER
) -> Float[np.ndarray, "samples *columns"]:
    """Zero-phase Butterworth low-pass along the first axis (filtered forwards and backwards).

    Ends are continued by the series turned about its last value; a series of a few samples by as many as it
    has. A cutoff at or above the Nyquist frequency leaves everything: there is nothing above it.

    Args:
        values: one row a sample; no NaN.
        rate: [Hz].
        cutoff_Hz: corner of the single pass [Hz].
        order: of the single pass.
    """
    padding = 3 * (2 * ((order + 1) // 2) + 1)
    if cutoff_Hz >= rate / 2 or values.shape[0] < 2:
        return values
    from scipy.signal import sosfiltfilt  # noqa: PLC0415 (slow to load; settings lead here)

    padding = min(padding, values.shape[0] - 1)
    return sosfiltfilt(_sections(order, cutoff_Hz, rate), values, axis=0, padlen=padding)


@lru_cache(maxsize=256)
def _sections(order: int, cutoff_Hz: float, rate: float) -> Float[np.ndarray, "sections 6"]:
    """Designed once for each corner: that takes as long as filtering a trial."""
    from scipy.signal import butter  # noqa: PLC0415 (likewise)

    return np.asarray(butter(order, cutoff_Hz, btype="low", fs=rate, output="sos"))
