"""The uniform clock behind a time column: rounded, jittering, with rows missing or repeated, or unusable."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.interpolate import CubicSpline

from solver.common.errors import CaptureError
from solver.common.notes import Kind, Note, noted
from solver.common.true_runs import runs

FINEST_DECIMALS = 9  # time columns are printed with at most so many decimals; beyond is float noise
JITTER = 0.05  # [samples] how far a time may be off beyond its rounding: clocks are that good
# [samples] rows off the uniform clock by less are moved onto it; from half on, their order is a guess
LARGEST_JITTER = 0.45
RATE_TOLERANCE = 5e-4  # header and time column that differ by less say the same
FEWEST_JITTERING = 10  # [rows] that jitter about a clock: fewer may fit a clock by chance
SINGLE_STEPS = 0.8  # share of steps by one sample in a recording that jitters; events come at any time
GAP_LIMIT = 10.0  # missing rows per present row; with more, two recordings are in one file


@dataclass(frozen=True)
class Clock:
    """Where each row of a file lies on a uniform clock.

    `sample[i]` is the index of row i; rows with `keep` False repeat the row before them. Indices without a
    row are gaps. Where rows were taken at irregular moments, `moments` says when, in samples.
    """

    rate: float  # [Hz]
    start_time: float  # [s]
    sample: Int[np.ndarray, " rows"]
    keep: Bool[np.ndarray, " rows"]
    notes: tuple[Note, ...] = ()
    moments: Float[np.ndarray, " rows"] | None = None

    @property
    def samples(self) -> int:
        """Length of the clock, gaps included."""
        return int(self.sample[-1]) + 1

    def placed(self, values: Float[np.ndarray, "rows *columns"]) -> Float[np.ndarray, "samples *columns"]:
        """The rows at their places on the clock, as they were taken; NaN in the gaps."""
        result = np.full((self.samples, *values.shape[1:]), np.nan)
        result[self.sample[self.keep]] = values[self.keep]
        return result

    def moved(self, placed: Float[np.ndarray, "samples *columns"]) -> Float[np.ndarray, "samples *columns"]:
        """What was taken between two samples, moved onto them by cubic splines; gaps stay gaps.

        Args:
            placed: on the clock, numbers that mean "none" already NaN; each stretch without NaN has a spline
                of its own.
        """
        if self.moments is None:
            return placed
        result = np.full_like(placed, np.nan)
        taken = self.placed(self.moments)
        for column, moved in zip(
            placed.reshape(self.samples, -1).T, result.reshape(self.samples, -1).T, strict=True
        ):
            for start, end in runs(np.isfinite(column)):
                first, last = taken[start], taken[end - 1]
                nearest = np.arange(round(first), round(last) + 1)
                nearest = nearest[(nearest >= 0) & (nearest < self.samples)]
                if end - start > 1:
                    spline = CubicSpline(taken[start:end], column[start:end], bc_type="natural")
                    moved[nearest] = spline(np.clip(nearest, first, last))
                else:
                    moved[nearest] = column[start]
        return result


def find_clock(
    times: Float[np.ndarray, " rows"], *, path: Path, lines: Sequence[int], header_rate: float | None = None
) -> Clock:
    """Rate from the first and last time and the number of samples between them; the header's only in need.

    The median time step is no rate: 60 Hz printed to the millisecond steps by 16 and 17 ms.

    Args:
        times: the time column [s]; NaN where it was blank.
        path: the file, for messages.
        lines: line number in the file of each row, for messages.
        header_rate: what the header claims [Hz].

    Raises:
        CaptureError: times run backwards, or step so irregularly that they are no recording's, or
            there is no rate at all.
    """
    rows = len(times)
    if rows == 1 or not np.isfinite(times).any() or np.ptp(times[np.isfinite(times)]) == 0:
        return _header_clock(times, path, header_rate)
    if not np.isfinite(times).all():
        return _with_stamps_missing(times, path, lines, header_rate)
    steps = np.diff(times)
    if steps.min() < 0:
        back = np.flatnonzero(steps < 0)
        k = int(back[0])
        others = f" (likewise {_listed([lines[i + 1] for i in back[1:]])})" if len(back) > 1 else ""
        raise CaptureError(
            f"{path}: line {lines[k + 1]}: time runs backwards, from {times[k]:g} to {times[k + 1]:g} s"
            f"{others}. Are these two recordings in one file? Export them one by one."
        )
    if header_rate and abs(header_rate - 1) > 0.5 and np.allclose(steps, 1, rtol=0, atol=1e-9):
        note = Note(
            Kind.OTHER,
            f"{path.name}: the time column counts frames; times follow from the header's {header_rate:g} Hz",
        )
        return Clock(header_rate, 0.0, np.arange(rows), np.ones(rows, bool), (note,))

    resolution = resolution_of(times)
    sample, rows_lie = _on_samples(times, resolution, header_rate)
    if sample is None:
        raise _irregular(times, path, lines)
    _refuse_two_recordings(times, sample, path, lines)
    keep = np.r_[True, np.diff(sample) > 0]
    notes = _gap_notes(times, sample, keep, lines, path.name)

    span = float(times[-1] - times[0])
    rate = round(float(sample[-1]) / span, FINEST_DECIMALS)
    if rows_lie is _Rows.ABOUT:
        rate = round(float(np.polyfit(times[keep], sample[keep], 1)[0]), FINEST_DECIMALS)
    if header_rate and abs(header_rate - rate) <= max(1e-9, rate * resolution / span):
        rate = header_rate  # the same within what rounding of the times can tell
    elif header_rate and abs(header_rate / rate - 1) > RATE_TOLERANCE:
        notes += noted(
            Kind.OTHER,
            f"{path.name}: the header says {header_rate:g} Hz, the time column {rate:.6g} Hz; "
            "the time column is used",
        )
    if rows_lie is _Rows.ON:
        return Clock(rate, float(times[0]), sample, keep, notes)
    start_time = float(times[0])
    if rows_lie is _Rows.ABOUT:
        start_time = float(np.mean(times[keep] - sample[keep] / rate))
    moments = (times - start_time) * rate
    off = np.abs(moments - sample)
    worst = int(np.argmax(off))
    notes += noted(
        Kind.OTHER,
        f"{path.name}: the time steps are irregular (up to {off[worst]:.2f} of a step of "
        f"{1000 / rate:.4g} ms off, line {lines[worst]}); resampled at {rate:.6g} Hz",
    )
    return Clock(rate, start_time, sample, keep, notes, moments)


class _Rows(Enum):
    """How rows lie to a uniform clock."""

    ON = "on it, but for rounding"
    ABOUT = "about it, by less than half a step"
    ADRIFT = "in its order"


def _on_samples(
    times: Float[np.ndarray, " rows"], resolution: float, header_rate: float | None
) -> tuple[Int[np.ndarray, " rows"] | None, _Rows]:
    """The sample of each row, and how the rows lie to the clock; None where they are no recording's."""
    in_order = np.arange(len(times))
    if fits(times, in_order, resolution) and not hides_gaps(times, resolution, header_rate):
        return in_order, _Rows.ON
    sample, found = with_gaps(times, resolution), _Rows.ON
    if sample is None:
        sample, found = off_beat(times, header_rate), _Rows.ABOUT
    if sample is None:
        sample, found = uneven(times), _Rows.ADRIFT
    return sample, found


def _with_stamps_missing(
    times: Float[np.ndarray, " rows"], path: Path, lines: Sequence[int], header_rate: float | None
) -> Clock:
    """The clock of a file in which some rows have no time.

    Where the rows with a time on both sides are as many steps apart as there are rows between, these stand
    evenly between them. Elsewhere nothing tells when they were taken: they are left out, and leave a gap.
    """
    filled, known = _between_neighbours(times)
    clock = find_clock(
        filled[known],
        path=path,
        lines=[line for line, is_known in zip(lines, known, strict=True) if is_known],
        header_rate=header_rate,
    )
    place = np.maximum(np.cumsum(known) - 1, 0)  # a row left out stands with the one before it, not kept
    notes: tuple[Note, ...] = ()
    for rows, what in (
        (np.isnan(times) & known, "it follows from the rows before and after"),
        (~known, "it does not follow from the rows around, so these rows are left out"),
    ):
        if rows.any():
            where = _listed([lines[int(i)] for i in np.flatnonzero(rows)])
            notes += noted(Kind.OTHER, f"{path.name}: {where}, column 'time': the time is missing; {what}")
    return replace(
        clock,
        sample=clock.sample[place],
        keep=clock.keep[place] & known,
        notes=(*notes, *clock.notes),
        moments=None if clock.moments is None else clock.moments[place],
    )


def _between_neighbours(
    times: Float[np.ndarray, " rows"],
) -> tuple[Float[np.ndarray, " rows"], Bool[np.ndarray, " rows"]]:
    """The times with missing ones put in where their neighbours decide; and which are known then."""
    filled, known = times.copy(), np.isfinite(times)
    steps = np.diff(times)
    steps = steps[np.isfinite(steps)]
    if not len(steps):
        return filled, known
    step = float(np.median(steps))
    for start, end in runs(~known):
        if start == 0 or end == len(times):
            continue
        apart = times[end] - times[start - 1]
        if step > 0 and abs(apart / step - (end - start + 1)) <= LARGEST_JITTER:
            filled[start:end] = np.linspace(times[start - 1], times[end], end - start + 2)[1:-1]
    return filled, np.isfinite(filled)


def _header_clock(times: Float[np.ndarray, " rows"], path: Path, header_rate: float | None) -> Clock:
    rows = len(times)
    start = float(times[0]) if np.isfinite(times[0]) else 0.0
    if not header_rate:
        if rows == 1:
            return Clock(float("nan"), start, np.zeros(1, int), np.ones(1, bool))
        raise CaptureError(f"{path}: the time column holds only one time, or none. Export it again.")
    notes: tuple[Note, ...] = ()
    if rows > 1:
        notes = noted(
            Kind.OTHER,
            f"{path.name}: the time column is unusable; times follow from the header's {header_rate:g} Hz",
        )
    return Clock(header_rate, start, np.arange(rows), np.ones(rows, bool), notes)


def _irregular(times: Float[np.ndarray, " rows"], path: Path, lines: Sequence[int]) -> CaptureError:
    steps = np.diff(times)
    median = float(np.median(steps))
    if median == 0:
        return CaptureError(f"{path}: most rows repeat the time of the row before. Export it again.")
    whole = np.maximum(np.round(steps / median), 1)
    k = int(np.argmax(np.abs(steps - whole * median)))
    return CaptureError(
        f"{path}: line {lines[k + 1]}: the time steps are irregular ({steps.min():.6g} to "
        f"{steps.max():.6g} s; here from {times[k]:.6g} to {times[k + 1]:.6g} s): most are far from the "
        "usual one. Export at a constant rate."
    )


def _refuse_two_recordings(
    times: Float[np.ndarray, " rows"], sample: Int[np.ndarray, " rows"], path: Path, lines: Sequence[int]
) -> None:
    k = int(np.argmax(np.diff(sample)))
    if sample[-1] + 1 > (1 + GAP_LIMIT) * len(times):
        raise CaptureError(
            f"{path}: line {lines[k + 1]}: time jumps from {times[k]:.6g} to {times[k + 1]:.6g} s. "
            "Are these two recordings in one file? Export them one by one."
        )


def _gap_notes(
    times: Float[np.ndarray, " rows"],
    sample: Int[np.ndarray, " rows"],
    keep: Bool[np.ndarray, " rows"],
    lines: Sequence[int],
    source: str,
) -> tuple[Note, ...]:
    notes: tuple[Note, ...] = ()
    jumps = np.diff(sample)
    if jumps.max(initial=0) > 1:
        first = times[int(np.argmax(jumps > 1))]
        notes += noted(
            Kind.OTHER,
            f"{source}: {int((jumps[jumps > 1] - 1).sum())} rows are missing in "
            f"{int((jumps > 1).sum())} places (first after {first:g} s); they stay gaps",
        )
    if not keep.all():
        repeated = np.flatnonzero(~keep)
        where = _listed([lines[int(i)] for i in repeated])
        notes += noted(
            Kind.OTHER,
            f"{source}: {len(repeated)} rows repeat the time before them ({where}, "
            f"first at {times[repeated[0]]:g} s); the first of each is used",
        )
    return notes


def _listed(lines: Sequence[int]) -> str:
    """As in "line 7", or "lines 7, 9, 12 and 30 more"."""
    shown = ", ".join(str(line) for line in lines[:5])
    more = f" and {len(lines) - 5} more" if len(lines) > 5 else ""
    return f"line{'s' if len(lines) > 1 else ''} {shown}{more}"


def resolution_of(times: Float[np.ndarray, " rows"]) -> float:
    """Smallest power of ten that all times are multiples of [s]: how far they were rounded."""
    for decimals in range(FINEST_DECIMALS):
        if np.allclose(times, np.round(times, decimals), rtol=0, atol=10.0**-FINEST_DECIMALS):
            return float(10.0**-decimals)
    return float(10.0**-FINEST_DECIMALS)


def fits(times: Float[np.ndarray, " rows"], sample: Int[np.ndarray, " rows"], resolution: float) -> bool:
    """Whether the times are a uniform clock's at these samples, but for rounding and jitter."""
    period = (times[-1] - times[0]) / sample[-1]
    error = np.abs(times - times[0] - sample * period).max()
    return bool(error <= 1.01 * resolution + JITTER * period)


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


def with_gaps(times: Float[np.ndarray, " rows"], resolution: float) -> Int[np.ndarray, " rows"] | None:
    """The sample of each row, where steps are whole multiples of one period; None where they are not."""
    steps = np.diff(times)
    median = float(np.median(steps))
    single = steps[(steps > 0.5 * median) & (steps < 1.5 * median)]
    if not len(single):
        return None
    period = float(single.mean())
    jumps = np.round(steps / period).astype(int)
    if np.abs(steps - jumps * period).max() > 1.01 * resolution + JITTER * period:
        return None
    return np.r_[0, np.cumsum(jumps)]


def off_beat(times: Float[np.ndarray, " rows"], header_rate: float | None) -> Int[np.ndarray, " rows"] | None:
    """The sample of each row, where rows lie about a uniform clock by less than half a step; else None."""
    moving = np.diff(times, prepend=-np.inf) > 0
    own = times[moving]
    if len(own) < FEWEST_JITTERING:
        return None
    median = float(np.median(np.diff(own)))
    periods = [median * (1 + percent / 100) for percent in range(-6, 7)]
    periods += [1 / header_rate] if header_rate else []
    best, least = None, LARGEST_JITTER
    for period in periods:
        sample, off = _settled(own, period)
        steps = np.diff(sample)
        if off <= least and (steps > 0).all() and (steps == 1).mean() >= SINGLE_STEPS:
            best, least = sample, off
    return None if best is None else (best - best[0])[np.cumsum(moving) - 1]


def uneven(times: Float[np.ndarray, " rows"]) -> Int[np.ndarray, " rows"] | None:
    """The sample of each row by their order, where most steps are near the usual one; else None.

    A step of one and a half and more leaves a gap. The rows may drift about a uniform clock by any amount.
    """
    moving = np.diff(times, prepend=-np.inf) > 0
    steps = np.diff(times[moving])
    if len(steps) < FEWEST_JITTERING:
        return None
    multiples = steps / np.median(steps)
    if np.mean((multiples > 0.5) & (multiples < 1.5)) < SINGLE_STEPS:
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
