"""Trials that show the same recording: byte for byte, or cut, shifted, resampled and with other noise.

Markers alone are compared, so that the answer before a fit and the one about a finished release are the same.
"""

import hashlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations, combinations_with_replacement, groupby

import numpy as np
from jaxtyping import Float
from scipy.optimize import minimize_scalar
from scipy.signal import fftconvolve

RATE_HZ = 50.0  # at which recordings are laid over each other first
LEAST_S = 1.0  # in common
LEAST_LABELS = 3  # likewise
LOOKED_AT = 100  # frames, for what is usual of a recording
ROUNDED_M = 1e-4
STIFF_M = 0.01  # standard deviation of a distance on one segment: skin moves by less
STIFF_APART_M = 0.01  # RMS of such distances, cut from other parts of a movement
PAIRS = 8  # of markers that move most against each other
MOVING_M = 0.02  # standard deviation of their distance, of which there has to be one
MOST_LAGS = 5
NEARLY_M = 0.05  # RMS of their distances half a step off: feet pass each other at 5 m/s and more
SAME_M = 0.003  # RMS likewise, and of all distances; 0.2 mm of noise are 0.3 mm, the rest is interpolated
LONGEST_STEP = 1.5  # of the usual one: more, and frames were dropped
COMPARED_AT = 50  # instants of the overlap


@dataclass(frozen=True)
class Places:
    """Markers of a trial."""

    times: Float[np.ndarray, " frames"]  # [s] rising, gaps where frames were dropped
    markers: Float[np.ndarray, "frames markers 3"]  # [m] NaN where not seen


@dataclass(frozen=True)
class Recording:
    """What a trial is compared by; its markers are read again where that is not enough."""

    trial_id: str
    digest: str  # of its markers about their middle, rounded; names do not enter
    labels: tuple[str, ...]
    usual: Float[np.ndarray, "markers markers"]  # [m] mean distance of two markers
    spread: Float[np.ndarray, "markers markers"]  # [m] its standard deviation
    again: Callable[[], Places]


def recording_of(
    trial_id: str, labels: Sequence[str], places: Places, again: Callable[[], Places]
) -> Recording:
    """A trial as it is compared.

    Args:
        trial_id: of the trial.
        labels: of its markers, as a release has them.
        places: of the markers.
        again: reads the places once more; they are not kept.
    """
    some = np.unique(np.linspace(0, len(places.times) - 1, LOOKED_AT).astype(int))
    seen = places.markers[some]
    far = np.linalg.norm(seen[:, :, None] - seen[:, None], axis=-1)
    known = np.isfinite(far)
    count = np.where(known.sum(axis=0) > len(some) // 2, known.sum(axis=0), np.nan)
    usual = np.where(known, far, 0.0).sum(axis=0) / count
    spread = np.sqrt(np.where(known, (far - usual) ** 2, 0.0).sum(axis=0) / count)
    return Recording(
        trial_id,
        _digest(places.markers),
        tuple(labels),
        usual.astype(np.float32),
        spread.astype(np.float32),
        again,
    )


def _digest(markers: Float[np.ndarray, "frames markers 3"]) -> str:
    """The same wherever the laboratory's origin lies, and whatever markers are called."""
    middle = np.nanmean(markers.reshape(-1, 3), axis=0) if np.isfinite(markers).any() else 0.0
    rounded = np.round((markers - middle) / ROUNDED_M)
    whole = np.where(np.isfinite(rounded), rounded, 2**30).astype("<i4")
    paths = sorted(hashlib.sha256(whole[:, k].tobytes()).digest() for k in range(whole.shape[1]))
    return hashlib.sha256(b"".join(paths)).hexdigest()


def same_recordings(recordings: Sequence[Recording]) -> Iterator[tuple[Recording, Recording]]:
    """Pairs that show the same, each in the order in which they are given.

    Args:
        recordings: of all trials.
    """
    read = lru_cache(maxsize=16)(lambda k: recordings[k].again())
    alike = {*_equal_pairs(recordings), *_of_one_person(recordings)}
    for i, j in sorted(alike):
        one, other = recordings[i], recordings[j]
        if one.digest == other.digest or _is_copy(one, other, read(i), read(j)):
            yield one, other


def _equal_pairs(recordings: Sequence[Recording]) -> Iterator[tuple[int, int]]:
    order = sorted(range(len(recordings)), key=lambda k: (recordings[k].digest, k))
    for _, equal in groupby(order, key=lambda k: recordings[k].digest):
        yield from combinations(equal, 2)


def _of_one_person(recordings: Sequence[Recording]) -> Iterator[tuple[int, int]]:
    """Pairs whose markers sit alike on the segments: one person in one session, or a copy of it.

    Recordings of the same markers are compared all at once: a release has too many pairs to ask one by one.
    """
    sets: dict[tuple[str, ...], list[int]] = {}
    for k, one in enumerate(recordings):
        sets.setdefault(one.labels, []).append(k)
    for (labels, group), (others, more) in combinations_with_replacement(sets.items(), 2):
        shared = sorted(set(labels) & set(others))
        if len(shared) < LEAST_LABELS:
            continue
        mine, theirs = (_stiff([recordings[k] for k in own], shared) for own in (group, more))
        for i, row in zip(group, mine, strict=True):
            off = theirs - row
            common = np.isfinite(off)
            apart = np.sqrt(np.where(common, off**2, 0.0).sum(axis=1) / np.maximum(common.sum(axis=1), 1))
            alike = np.flatnonzero(apart < STIFF_APART_M)
            yield from ((min(i, more[k]), max(i, more[k])) for k in alike if i != more[k])


def _stiff(group: Sequence[Recording], shared: Sequence[str]) -> Float[np.ndarray, "recordings pairs"]:
    """Distances within segments [m]; NaN for pairs that move against each other."""
    columns = [group[0].labels.index(label) for label in shared]
    above = np.triu_indices(len(columns), 1)
    rows = []
    for one in group:
        usual, spread = (a[np.ix_(columns, columns)][above] for a in (one.usual, one.spread))
        rows.append(np.where(spread < STIFF_M, usual, np.nan))
    return np.array(rows, dtype=np.float32)


def _is_copy(one: Recording, other: Recording, mine: Places, theirs: Places) -> bool:
    """Whether both show the same where they overlap.

    People who stand look alike at all times: without movement nothing tells a copy from another trial.
    """
    shared = sorted(set(one.labels) & set(other.labels))
    columns = [[r.labels.index(label) for label in shared] for r in (one, other)]
    spread = np.fmin(*(r.spread[np.ix_(c, c)] for r, c in zip((one, other), columns, strict=True)))
    most = np.argsort(np.nan_to_num(np.triu(spread), nan=0.0), axis=None)[: -PAIRS - 1 : -1]
    if spread.ravel()[most[0]] < MOVING_M:
        return False
    pairs = np.array(np.unravel_index(most, spread.shape))
    a, b = (_TimeHistories(p, c, pairs) for p, c in zip((mine, theirs), columns, strict=True))
    return any(_agree(a, b, lag_s) for lag_s in _likely_lags(a, b))


class _TimeHistories:
    """Distances between shared markers over a recording's longest stretch without dropped frames."""

    def __init__(self, places: Places, columns: Sequence[int], pairs: Float[np.ndarray, "2 pairs"]) -> None:
        whole = _longest_run(places.times)
        self._times = places.times[whole] - places.times[whole][0]
        self._markers = places.markers[whole][:, columns]
        self.pairs = pairs
        first, second = (self._markers[:, k] for k in pairs)
        self._moving = [_filled(row) for row in np.linalg.norm(first - second, axis=-1).T]
        self.lasts_s = float(self._times[-1])

    def moving(self, times: Float[np.ndarray, " times"]) -> Float[np.ndarray, "times pairs"]:
        """Of the pairs that move most [m], gaps bridged."""
        return np.column_stack([np.interp(times, self._times, row) for row in self._moving])

    def all(self, times: Float[np.ndarray, " times"]) -> Float[np.ndarray, "times markers markers"]:
        """Of all pairs [m]; NaN where one is not seen."""
        at = np.interp(times, self._times, np.arange(len(self._times)))
        low = np.floor(at).astype(int)
        high = np.minimum(low + 1, len(self._times) - 1)
        share = (at - low)[:, None, None]
        places = self._markers[low] * (1 - share) + self._markers[high] * share
        return np.linalg.norm(places[:, :, None] - places[:, None], axis=-1)


def _longest_run(times: Float[np.ndarray, " frames"]) -> slice:
    if len(times) < 2:
        return slice(None)
    steps = np.diff(times)
    ends = np.array([0, *(1 + np.flatnonzero(steps > LONGEST_STEP * np.median(steps))), len(times)])
    longest = int(np.argmax(np.diff(ends)))
    return slice(int(ends[longest]), int(ends[longest + 1]))


def _filled(row: Float[np.ndarray, " frames"]) -> Float[np.ndarray, " frames"]:
    known = np.flatnonzero(np.isfinite(row))
    return np.interp(np.arange(len(row)), known, row[known]) if len(known) else np.zeros(len(row))


def _likely_lags(one: _TimeHistories, other: _TimeHistories) -> list[float]:
    """By how much the other may begin later than the one [s], the likeliest first: a gait repeats itself.

    Sums of squares of all overlaps come from cumulative sums, products from one convolution.
    """
    mine, theirs = (c.moving(np.arange(0.0, c.lasts_s + 1e-9, 1 / RATE_HZ)) for c in (one, other))
    n, m, least = len(mine), len(theirs), round(LEAST_S * RATE_HZ)
    if min(n, m) < least:
        return []
    middle = mine.mean(axis=0)  # keeps the sums small
    mine, theirs = mine - middle, theirs - middle
    lags = np.arange(-(m - least), n - least + 1)
    product = np.sum([fftconvolve(a, b[::-1]) for a, b in zip(mine.T, theirs.T, strict=True)], axis=0)
    squares, others = (np.concatenate([[0.0], np.cumsum((a**2).sum(axis=1))]) for a in (mine, theirs))
    first, last = np.maximum(lags, 0), np.minimum(lags + m, n)
    total = squares[last] - squares[first] + others[last - lags] - others[first - lags]
    mean = np.maximum(total - 2 * product[lags + m - 1], 0) / ((last - first) * mine.shape[1])
    lowest = mean <= np.minimum(np.append(np.inf, mean[:-1]), np.append(mean[1:], np.inf))
    near = np.flatnonzero(lowest & (mean < NEARLY_M**2))
    return [float(lags[k]) / RATE_HZ for k in near[np.argsort(mean[near])][:MOST_LAGS]]


def _agree(one: _TimeHistories, other: _TimeHistories, near_s: float) -> bool:
    def overlap(lag_s: float, count: int) -> Float[np.ndarray, " times"]:
        return np.linspace(max(0.0, lag_s), min(one.lasts_s, other.lasts_s + lag_s), count)

    def apart(lag_s: float) -> float:
        times = overlap(lag_s, COMPARED_AT)
        return _rms(one.moving(times) - other.moving(times - lag_s))

    best = minimize_scalar(
        apart, bounds=(near_s - 1 / RATE_HZ, near_s + 1 / RATE_HZ), options={"xatol": 1e-4}
    )
    times = overlap(best.x, COMPARED_AT)
    if one.moving(times).std(axis=0).max() < MOVING_M:
        return False
    off = one.all(times) - other.all(times - best.x)
    return max(_rms(off), _rms(off[:, *one.pairs])) < SAME_M


def _rms(values: Float[np.ndarray, "..."]) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if known.size else np.inf
