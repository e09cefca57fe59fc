"""On which sample of a uniform clock each time lies: rounded, jittering, with rows missing or repeated.

Times are in seconds, periods in seconds a sample, jitter in samples.
"""

import numpy as np
from jaxtyping import Float, Int

from solver.capture.clock_settings import ClockSettings


def resolution_of(times: Float[np.ndarray, " rows"], finest_decimals: int) -> float:
    """Smallest power of ten that all times are multiples of [s]: how far they were rounded."""
    for decimals in range(finest_decimals):
        if np.allclose(times, np.round(times, decimals), rtol=0, atol=10.0**-finest_decimals):
            return float(10.0**-decimals)
    return float(10.0**-finest_decimals)


def fits(
    times: Float[np.ndarray, " rows"],
    sample: Int[np.ndarray, " rows"],
    resolution: float,
    settings: ClockSettings,
) -> bool:
    """Whether the times are a uniform clock's at these samples, but for rounding and jitter."""
    period = (times[-1] - times[0]) / sample[-1]
    error = np.abs(times - times[0] - sample * period).max()
    return bool(error <= 1.01 * resolution + settings.jitter * period)


def hides_gaps(times: Float[np.ndarray, " rows"], resolution: float, header_rate: float | None) -> bool:
    """Whether missing or repeated rows could pass as rounding, where one period is about the last digit.

    Rounding leaves a residual no wider than the last digit and comes back in regular intervals; rows that
    were lost don't, except where there is but one.
    """
    steps = np.diff(times)
    period = float(np.median(steps))
    if period <= 0 or (header_rate and abs(period * header_rate - 1) > 0.01):
        return False
    multiples = steps / period
    odd = np.round(multiples) != 1
    if not np.allclose(multiples, np.round(multiples), atol=1e-3) or not odd.any():
        return False
    if header_rate:
        return True
    order = np.arange(len(times))
    residual = times - np.polyval(np.polyfit(order, times, 1), order)
    return bool(odd.sum() == 1 or (odd.mean() < 0.1 and np.ptp(residual) > 1.1 * resolution))


def with_gaps(
    times: Float[np.ndarray, " rows"], resolution: float, settings: ClockSettings
) -> Int[np.ndarray, " rows"] | None:
    """The sample of each row, where steps are whole multiples of one period; None where they are not."""
    steps = np.diff(times)
    median = float(np.median(steps))
    single = steps[(steps > 0.5 * median) & (steps < 1.5 * median)]
    if not len(single):
        return None
    period = float(single.mean())
    jumps = np.round(steps / period).astype(int)
    if np.abs(steps - jumps * period).max() > 1.01 * resolution + settings.jitter * period:
        return None
    return np.r_[0, np.cumsum(jumps)]


def off_beat(
    times: Float[np.ndarray, " rows"], header_rate: float | None, settings: ClockSettings
) -> Int[np.ndarray, " rows"] | None:
    """The sample of each row, where rows lie about a uniform clock by less than half a step; else None."""
    moving = np.diff(times, prepend=-np.inf) > 0
    own = times[moving]
    if len(own) < settings.fewest_jittering:
        return None
    median = float(np.median(np.diff(own)))
    periods = [median * (1 + percent / 100) for percent in range(-6, 7)]
    periods += [1 / header_rate] if header_rate else []
    best, least = None, settings.largest_jitter
    for period in periods:
        sample, off = _settled(own, period)
        steps = np.diff(sample)
        if off <= least and (steps > 0).all() and (steps == 1).mean() >= settings.single_steps:
            best, least = sample, off
    return None if best is None else (best - best[0])[np.cumsum(moving) - 1]


def uneven(times: Float[np.ndarray, " rows"], settings: ClockSettings) -> Int[np.ndarray, " rows"] | None:
    """The sample of each row by their order, where most steps are near the usual one; else None.

    A step of one and a half and more leaves a gap. The rows may drift about a uniform clock by any amount.
    """
    moving = np.diff(times, prepend=-np.inf) > 0
    steps = np.diff(times[moving])
    if len(steps) < settings.fewest_jittering:
        return None
    multiples = steps / np.median(steps)
    if np.mean((multiples > 0.5) & (multiples < 1.5)) < settings.single_steps:
        return None
    return np.r_[0, np.cumsum(np.maximum(np.round(multiples), 1).astype(int))][np.cumsum(moving) - 1]


def _settled(times: Float[np.ndarray, " rows"], period: float) -> tuple[Int[np.ndarray, " rows"], float]:
    """Samples of a clock fitted to ever longer beginnings, and how far the worst row is off [samples]."""
    offset, used = float(times[0]), min(16, len(times))
    while True:
        for _ in range(4):
            sample = np.round((times[:used] - offset) / period).astype(int)
            if sample[-1] <= sample[0]:
                return sample, np.inf
            period, offset = (float(x) for x in np.polyfit(sample, times[:used], 1))
        if used == len(times):
            return sample, float(np.abs((times - offset) / period - sample).max())
        used = min(2 * used, len(times))
