"""Trials that are in a release twice: byte for byte, or cut, shifted, resampled and with other noise."""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from jaxtyping import Float
from scipy.signal import fftconvolve

from addb_viewer.dataset.check.finding import Finding, error
from addb_viewer.dataset.check.physics import column, vector

JOINTS = ("hip_flexion_r", "hip_flexion_l", "knee_angle_r", "knee_angle_l")
RATE_HZ = 25.0  # at which angles are compared: steps of joints are slower
LEAST_S = 1.0  # in common
ANGLE_DEG = 3.0  # RMS of all four, without what they differ by all the time
LEAST_DEG = 5.0  # standard deviation of an angle, of which there has to be one
MOST_LAGS = 5
NEARLY_DEG = 10.0  # likewise, half a step off: knees turn at 6 rad/s
DISTANCE_M = 0.003  # RMS of distances between markers: copies with 0.2 mm of noise keep 0.3 mm
ROUNDED_M = 1e-4
SHIFTS = np.linspace(-0.5, 0.5, 11)  # of a step of the comparison


@dataclass(frozen=True)
class Content:
    """What a trial is compared by."""

    trial_id: str
    digest: str  # of its markers, centred and rounded
    times: Float[np.ndarray, " frames"]  # [s] from the first frame
    angles: Float[np.ndarray, "frames 4"]  # [rad]
    markers: Float[np.ndarray, "frames markers 3"]  # [m], in the order of their labels
    labels: tuple[str, ...]


def content_of(trial_id: str, kinematics: pa.Table, markers: pa.Table) -> Content | None:
    """A trial as it is compared; None without frames or markers.

    Args:
        trial_id: of the trial.
        kinematics: its rows of that table.
        markers: likewise.
    """
    if not kinematics.num_rows or not markers.num_rows:
        return None
    frame = column(kinematics, "frame").astype(int)
    labels = tuple(sorted(set(markers["marker"].to_pylist())))
    places = np.full((len(frame), len(labels), 3), np.nan)
    row_of = {int(f): k for k, f in enumerate(frame)}
    at = np.array([row_of.get(int(f), -1) for f in column(markers, "frame")])
    which = pc.index_in(markers["marker"], value_set=pa.array(labels)).to_numpy()
    measured, known = vector(markers, "measured_{}_m"), at >= 0
    places[at[known], which[known]] = measured[known]
    times = column(kinematics, "time_s")
    angles = np.column_stack([np.nan_to_num(column(kinematics, f"q_{name}")) for name in JOINTS])
    return Content(trial_id, _digest(places), times - times[0], angles, places, labels)


def _digest(places: Float[np.ndarray, "frames markers 3"]) -> str:
    """The same wherever the laboratory's origin lies, and whatever markers are called."""
    centred = places - np.nanmean(places, axis=(0, 1))
    rounded = np.nan_to_num(np.round(centred / ROUNDED_M), nan=2**30).astype(np.int64)
    paths = sorted(hashlib.sha256(rounded[:, k].tobytes()).digest() for k in range(places.shape[1]))
    return hashlib.sha256(b"".join(paths)).hexdigest()


def duplicate_findings(contents: Sequence[Content], persons: Mapping[str, str]) -> Iterator[Finding]:
    """Every pair of trials that show the same recording.

    Args:
        contents: of all trials.
        persons: by trial_id.
    """
    for one, other in duplicate_pairs(contents):
        same = persons[one.trial_id] == persons[other.trial_id]
        whose = "" if same else f", and they are called two persons ({persons[one.trial_id]} and another)"
        kind = "the same recording as" if one.digest == other.digest else "a copy of a part of"
        yield error("duplicates", one.trial_id, f"is {kind} {other.trial_id}{whose}")


def duplicate_pairs(contents: Sequence[Content]) -> Iterator[tuple[Content, Content]]:
    """Pairs of the same content.

    Args:
        contents: of all trials.
    """
    grids = {c.trial_id: _on_grid(c) for c in contents}
    for one, other in combinations(contents, 2):
        if one.digest == other.digest or _is_near_copy(
            one, other, grids[one.trial_id], grids[other.trial_id]
        ):
            yield one, other


def _on_grid(content: Content) -> Float[np.ndarray, "steps 4"]:
    grid = np.arange(0.0, content.times[-1] + 1e-9, 1 / RATE_HZ)
    return _turned(content, grid)


def _is_near_copy(
    one: Content,
    other: Content,
    angles: Float[np.ndarray, "steps 4"],
    others: Float[np.ndarray, "steps 4"],
) -> bool:
    least = round(LEAST_S * RATE_HZ)
    if min(len(angles), len(others)) < least or (one.labels and len(set(one.labels) & set(other.labels)) < 3):
        return False
    return any(_agree(one, other, lag) for lag in _likely_lags(angles, others, least))


def _agree(one: Content, other: Content, lag: int) -> bool:
    """Whether angles and distances between markers are the same where both trials overlap.

    Angles may differ by a constant: models differ in where they are zero. People who stand look alike at all
    times: without movement nothing tells a copy from another trial.
    """
    off = {float(lag + shift) / RATE_HZ: 0.0 for shift in SHIFTS}
    for lag_s in off:
        times = np.arange(max(0.0, lag_s), min(one.times[-1], other.times[-1] + lag_s), 1 / RATE_HZ)
        mine, theirs = _turned(one, times), _turned(other, times - lag_s)
        if np.degrees(mine.std(axis=0).max()) < LEAST_DEG:
            return False
        apart = mine - theirs
        off[lag_s] = float(np.degrees(np.sqrt(np.mean((apart - apart.mean(axis=0)) ** 2))))
    best = sorted(off, key=lambda lag_s: off[lag_s])[:2]
    return any(off[k] < ANGLE_DEG and _distances_differ(one, other, k) < DISTANCE_M for k in best)


def _turned(content: Content, times: Float[np.ndarray, " times"]) -> Float[np.ndarray, "times 4"]:
    return np.column_stack(
        [np.interp(times, content.times, content.angles[:, k]) for k in range(len(JOINTS))]
    )


def _likely_lags(
    angles: Float[np.ndarray, "steps 4"], others: Float[np.ndarray, "others 4"], least: int
) -> list[int]:
    """By how many steps the other may begin later in the one, the likeliest first: a gait repeats itself.

    Sums of squares of all overlaps come from cumulative sums, products from one convolution.
    """
    n, m = len(angles), len(others)
    lags = np.arange(-(m - least), n - least + 1)
    product = sum(fftconvolve(angles[:, k], others[::-1, k]) for k in range(angles.shape[1]))
    product = np.asarray(product)[lags + m - 1]
    squares, other_squares = (
        np.concatenate([[0.0], np.cumsum((a**2).sum(axis=1))]) for a in (angles, others)
    )
    first, last = np.maximum(lags, 0), np.minimum(lags + m, n)
    total = squares[last] - squares[first] + other_squares[last - lags] - other_squares[first - lags]
    joints, common = angles.shape[1], last - first
    sums, other_sums = (np.cumsum(np.vstack([np.zeros(joints), a]), axis=0) for a in (angles, others))
    offset = (sums[last] - sums[first] - other_sums[last - lags] + other_sums[first - lags]) / common[:, None]
    mean = np.maximum((total - 2 * product) / (common * joints) - (offset**2).mean(axis=1), 0)
    lowest = mean <= np.minimum(np.append(np.inf, mean[:-1]), np.append(mean[1:], np.inf))
    near = np.flatnonzero(lowest & (mean < np.radians(NEARLY_DEG) ** 2))
    return [int(lags[k]) for k in near[np.argsort(mean[near])][:MOST_LAGS]]


def _distances_differ(one: Content, other: Content, lag_s: float) -> float:
    """RMS difference of distances between markers, where both trials overlap [m]."""
    shared = [label for label in one.labels if label in other.labels]
    begin, end = max(0.0, lag_s), min(one.times[-1], other.times[-1] + lag_s)
    times = np.linspace(begin, end, 12)
    mine, theirs = _placed(one, shared, times), _placed(other, shared, times - lag_s)
    far, others = (np.linalg.norm(p[:, :, None] - p[:, None], axis=-1) for p in (mine, theirs))
    off = far - others
    return float(np.sqrt(np.nanmean(off**2))) if np.isfinite(off).any() else np.inf


def _placed(
    content: Content, labels: Sequence[str], times: Float[np.ndarray, " times"]
) -> Float[np.ndarray, "times markers 3"]:
    columns = [content.labels.index(label) for label in labels]
    at = np.interp(times, content.times, np.arange(len(content.times)))
    low = np.clip(np.floor(at).astype(int), 0, len(content.times) - 1)
    high = np.minimum(low + 1, len(content.times) - 1)
    share = (at - low)[:, None, None]
    return content.markers[low][:, columns] * (1 - share) + content.markers[high][:, columns] * share
