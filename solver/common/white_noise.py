"""White noise of recorded signals, told by the signals themselves."""

import numpy as np
from jaxtyping import Float
from numpy.lib.stride_tricks import sliding_window_view

ORDER = 5  # of the differences: no motion shows in them between hundredths of a second
FIFTH_DIFFERENCE_GROWTH = 252**0.5  # how much larger than the noise they are: binomials (5 of 10)
NORMAL = 1.4826  # standard deviation of normal deviates, by the median of their absolute values
FEWEST_DIFFERENCES = 20  # differences


def white_noise(values: Float[np.ndarray, "samples columns"]) -> Float[np.ndarray, " columns"]:
    """Standard deviation of what changes from sample to sample in each column.

    Smooth signals have none, and neither have low-passed ones, unless they are sampled so slowly that what
    they do looks like noise. A few wild samples do not count: it is a median.

    Args:
        values: NaN where nothing was recorded.

    Returns:
        In the units of the values; NaN for columns with fewer than twenty stretches of six samples.
    """
    found = np.full(values.shape[1], np.nan)
    if len(values) <= ORDER:
        return found
    known = sliding_window_view(np.isfinite(values), ORDER + 1, axis=0).all(axis=2)
    enough = known.sum(axis=0) >= FEWEST_DIFFERENCES
    apart = np.where(known, np.abs(np.diff(values, ORDER, axis=0)), np.nan)[:, enough]
    found[enough] = NORMAL * np.nanmedian(apart, axis=0) / FIFTH_DIFFERENCE_GROWTH
    return found


def white_noise_together(values: Float[np.ndarray, "samples columns"]) -> float:
    """One standard deviation of all columns, recorded throughout; zero of fewer than six samples."""
    if len(values) <= ORDER:
        return 0.0
    return float(NORMAL * np.median(np.abs(np.diff(values, ORDER, axis=0))) / FIFTH_DIFFERENCE_GROWTH)
