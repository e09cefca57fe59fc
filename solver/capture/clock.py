"""The uniform clock behind a printed time column: rounded, with rows missing or repeated, or unusable."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.errors import CaptureError
from solver.settings_field import setting


@dataclass(frozen=True)
class ClockSettings:
    """What counts as a uniform clock."""

    finest_decimals: int = setting(
        9, unit="", why="time columns are printed with at most so many decimals; beyond is float noise"
    )
    jitter: float = setting(
        0.05, unit="samples", why="how far a time may be off beyond its rounding: clocks are that good"
    )
    rate_tolerance: float = setting(
        5e-4, unit="", why="header and time column that differ by less say the same"
    )
    gap_limit: float = setting(
        1.0, unit="", why="missing rows per present row; with more, two recordings are in one file"
    )


CLOCK = ClockSettings()


@dataclass(frozen=True)
class Clock:
    """Where each row of a file lies on a uniform clock.

    `sample[i]` is the index of row i; rows with `keep` False repeat the row before them. Indices without a
    row are gaps.
    """

    rate: float  # [Hz]
    start_time: float  # [s]
    sample: Int[np.ndarray, " rows"]
    keep: Bool[np.ndarray, " rows"]
    notes: tuple[str, ...] = ()

    @property
    def samples(self) -> int:
        """Length of the clock, gaps included."""
        return int(self.sample[-1]) + 1

    def placed(self, values: Float[np.ndarray, "rows *columns"]) -> Float[np.ndarray, "samples *columns"]:
        """The rows at their places on the clock; NaN in the gaps."""
        result = np.full((self.samples, *values.shape[1:]), np.nan)
        result[self.sample[self.keep]] = values[self.keep]
        return result


def find_clock(
    times: Float[np.ndarray, " rows"],
    *,
    path: Path,
    lines: Sequence[int],
    header_rate: float | None = None,
    settings: ClockSettings = CLOCK,
) -> Clock:
    """Rate from the first and last time and the number of samples between them; the header's only in need.

    The median time step is no rate: 60 Hz printed to the millisecond steps by 16 and 17 ms.

    Args:
        times: the time column [s]; NaN where it was blank.
        path: the file, for messages.
        lines: line number in the file of each row, for messages.
        header_rate: what the header claims [Hz].
        settings: what counts as uniform.

    Raises:
        CaptureError: times run backwards, or step irregularly, or there is no rate at all.
    """
    rows = len(times)
    if rows == 1 or not np.isfinite(times).any() or np.ptp(times[np.isfinite(times)]) == 0:
        return _header_clock(times, path, header_rate)
    if not np.isfinite(times).all():
        line = lines[int(np.argmin(np.isfinite(times)))]
        raise CaptureError(f"{path}: line {line}, column 'time': the time is missing. Fill it in.")
    steps = np.diff(times)
    if steps.min() < 0:
        k = int(np.argmin(steps >= 0))
        raise CaptureError(
            f"{path}: line {lines[k + 1]}: time runs backwards, from {times[k]:g} to {times[k + 1]:g} s. "
            "Are these two recordings in one file? Export them one by one."
        )
    if header_rate and abs(header_rate - 1) > 0.5 and np.allclose(steps, 1, rtol=0, atol=1e-9):
        note = (
            f"{path.name}: the time column counts frames; times follow from the header's {header_rate:g} Hz"
        )
        return Clock(header_rate, 0.0, np.arange(rows), np.ones(rows, bool), (note,))

    resolution = _resolution(times, settings.finest_decimals)
    sample = np.arange(rows)
    if not _fits(times, sample, resolution, settings) or _hides_gaps(times, resolution, header_rate):
        sample = _with_gaps(times, resolution=resolution, path=path, lines=lines, settings=settings)
    keep = np.r_[True, np.diff(sample) > 0]
    notes = _gap_notes(times, sample, keep, path.name)

    span = float(times[-1] - times[0])
    rate = round(float(sample[-1]) / span, settings.finest_decimals)
    if header_rate and abs(header_rate - rate) <= max(1e-9, rate * resolution / span):
        rate = header_rate  # the same within what rounding of the times can tell
    elif header_rate and abs(header_rate / rate - 1) > settings.rate_tolerance:
        notes += (
            f"{path.name}: the header says {header_rate:g} Hz, the time column {rate:.6g} Hz; "
            "the time column is used",
        )
    return Clock(rate, float(times[0]), sample, keep, notes)


def _header_clock(times: Float[np.ndarray, " rows"], path: Path, header_rate: float | None) -> Clock:
    rows = len(times)
    start = float(times[0]) if np.isfinite(times[0]) else 0.0
    if not header_rate:
        if rows == 1:
            return Clock(float("nan"), start, np.zeros(1, int), np.ones(1, bool))
        raise CaptureError(f"{path}: the time column holds one and the same time or none. Export it again.")
    notes: tuple[str, ...] = ()
    if rows > 1:
        notes = (
            f"{path.name}: the time column is unusable; times follow from the header's {header_rate:g} Hz",
        )
    return Clock(header_rate, start, np.arange(rows), np.ones(rows, bool), notes)


def _resolution(times: Float[np.ndarray, " rows"], finest_decimals: int) -> float:
    """Smallest power of ten that all times are multiples of [s]: how far they were rounded."""
    for decimals in range(finest_decimals):
        if np.allclose(times, np.round(times, decimals), rtol=0, atol=10.0**-finest_decimals):
            return float(10.0**-decimals)
    return float(10.0**-finest_decimals)


def _fits(
    times: Float[np.ndarray, " rows"],
    sample: Int[np.ndarray, " rows"],
    resolution: float,
    settings: ClockSettings,
) -> bool:
    period = (times[-1] - times[0]) / sample[-1]
    error = np.abs(times - times[0] - sample * period).max()
    return bool(error <= 1.01 * resolution + settings.jitter * period)


def _hides_gaps(times: Float[np.ndarray, " rows"], resolution: float, header_rate: float | None) -> bool:
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


def _with_gaps(
    times: Float[np.ndarray, " rows"],
    *,
    resolution: float,
    path: Path,
    lines: Sequence[int],
    settings: ClockSettings,
) -> Int[np.ndarray, " rows"]:
    steps = np.diff(times)
    median = float(np.median(steps))
    single = steps[(steps > 0.5 * median) & (steps < 1.5 * median)]
    if not len(single):
        raise CaptureError(f"{path}: most rows repeat the time of the row before. Export it again.")
    period = float(single.mean())
    jumps = np.round(steps / period).astype(int)
    error = np.abs(steps - jumps * period)
    k = int(np.argmax(error))
    if error[k] > 1.01 * resolution + settings.jitter * period:
        raise CaptureError(
            f"{path}: line {lines[k + 1]}: the time steps are irregular ({steps.min():.6g} to "
            f"{steps.max():.6g} s; here from {times[k]:.6g} to {times[k + 1]:.6g} s). "
            "Export at a constant rate."
        )
    k = int(np.argmax(jumps))
    if jumps.sum() + 1 > (1 + settings.gap_limit) * len(times):
        raise CaptureError(
            f"{path}: line {lines[k + 1]}: time jumps from {times[k]:.6g} to {times[k + 1]:.6g} s. "
            "Are these two recordings in one file? Export them one by one."
        )
    return np.r_[0, np.cumsum(jumps)]


def _gap_notes(
    times: Float[np.ndarray, " rows"],
    sample: Int[np.ndarray, " rows"],
    keep: Bool[np.ndarray, " rows"],
    source: str,
) -> tuple[str, ...]:
    notes: tuple[str, ...] = ()
    jumps = np.diff(sample)
    if jumps.max(initial=0) > 1:
        first = times[int(np.argmax(jumps > 1))]
        notes += (
            f"{source}: {int((jumps[jumps > 1] - 1).sum())} rows are missing in "
            f"{int((jumps > 1).sum())} places (first after {first:g} s); nothing is known there",
        )
    if not keep.all():
        repeated = times[int(np.argmin(keep))]
        notes += (
            f"{source}: {int((~keep).sum())} rows repeat the time before them (first at {repeated:g} s); "
            "the first of each is used",
        )
    return notes
