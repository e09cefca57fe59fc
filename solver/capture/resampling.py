"""Forces from their own clock onto the markers', with nothing folded down from above Nyquist."""

import numpy as np
from jaxtyping import Bool, Float
from scipy.interpolate import CubicSpline

from solver.common.filters import low_pass

# At 0.8 of the new Nyquist frequency and the 4th order, forwards and backwards, what would fold into the
# lower half of the new band (from 1.5 times the new Nyquist frequency up) is damped 150-fold and more, and
# what lies below a third of it passes within 0.1 %.
ANTI_ALIAS_SHARE = 0.8
ANTI_ALIAS_ORDER = 4

COLUMNS_TOGETHER = 80_000  # samples
ROUNDING_S = 0.001  # time columns are printed to the millisecond: a recording may seem to end that early


def covered(
    rate: float, start_time: float, samples: int, times: Float[np.ndarray, " frames"]
) -> Bool[np.ndarray, " frames"]:
    """Which times a recording covers, to half a sample and the rounding of printed times."""
    slack = 0.5 / rate + ROUNDING_S
    end_time = start_time + (samples - 1) / rate
    return (times >= start_time - slack) & (times <= end_time + slack)


def resample(
    values: Float[np.ndarray, "samples *columns"],
    rate: float,
    start_time: float,
    times: Float[np.ndarray, " frames"],
) -> Float[np.ndarray, "frames *columns"]:
    """Values at other times: low-passed first (zero phase) where the new clock is slower, else interpolated.

    Args:
        values: one row a sample; no NaN.
        rate: of the samples [Hz].
        start_time: of the first sample [s].
        times: equally spaced [s].

    Returns:
        NaN at times that the samples don't cover.
    """
    new_rate = rate_of(times)
    if new_rate < 0.999 * rate:
        values = low_pass(values, rate, ANTI_ALIAS_SHARE * new_rate / 2, ANTI_ALIAS_ORDER)
    return interpolate(values, rate, start_time, times)


def interpolate(
    values: Float[np.ndarray, "samples *columns"],
    rate: float,
    start_time: float,
    times: Float[np.ndarray, " frames"],
) -> Float[np.ndarray, "frames *columns"]:
    """Values at other times by a cubic spline; NaN where not covered. No filter."""
    result = np.full((len(times), *values.shape[1:]), np.nan)
    within = covered(rate, start_time, len(values), times)
    if within.any():
        samples = np.clip((times[within] - start_time) * rate, 0, len(values) - 1)
        nearest = np.round(samples)
        samples = np.where(np.abs(samples - nearest) < 1e-6, nearest, samples)
        result[within] = _between(values, samples) if len(values) > 1 else values[0]
    return result


def bridge_gaps(
    values: Float[np.ndarray, "rows columns"], known: Bool[np.ndarray, " rows"]
) -> Float[np.ndarray, "rows columns"]:
    """Lines across the rows that are not known; before the first and after the last that is, its value.

    Args:
        values: one row after the other.
        known: which of them are; at least one.
    """
    order = np.arange(len(values))
    return np.stack([np.interp(order, order[known], column[known]) for column in values.T], axis=1)


def _between(
    values: Float[np.ndarray, "samples *columns"], places: Float[np.ndarray, " places"]
) -> Float[np.ndarray, "places *columns"]:
    """A cubic spline's values; of many samples column by column, since a spline is four times its samples."""
    order = np.arange(len(values))
    if values.ndim != 2 or len(values) <= COLUMNS_TOGETHER:
        return CubicSpline(order, values)(places)
    return np.stack([CubicSpline(order, column)(places) for column in values.T], axis=1)


def rate_of(times: Float[np.ndarray, " frames"]) -> float:
    """Rate of equally spaced times [Hz]; infinite for a single one."""
    return (len(times) - 1) / float(times[-1] - times[0]) if len(times) > 1 else np.inf
