"""Whether loads of force plates lie under the feet that markers show: of one recording, or of two.

Labels are not asked. The markers that come near the floor belong to feet. While a plate is loaded, its centre
of pressure lies between low markers of one foot, to a centimetre or two. Forces of another trial miss them by
a foot's width where the same steps were cut alike, and by a stride where not. Treadmills are no exception,
since centre of pressure and foot travel together. Frames on which feet are unseen are not asked, and markers
of one foot alone contradict nothing.

Two alternatives are weighed, and the less favourable one counts: forces of another trial of such a person on
such plates, and forces of another moment, for which the loads are moved along the recording. Feet that stay
where they are fit at every moment; then nothing is told.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from solver.capture.capture import ForcePlate, Markers
from solver.common.plate_figures import JUDGED_N

LOADED_SHARE = 0.1  # of the plate's largest load: an untared plate is no load
FOOT_HEIGHT_M = 0.16  # markers that come so near the lowest are on feet
MOST_MARKERS = 16  # on two feet; of somebody who lies down, all would be low
LOW_M = 0.10  # above its own lowest: higher, the marker is on a swinging foot
# of the most foot markers that any frame shows: where fewer are seen, a foot may be there unseen
FEET_SEEN_SHARE = 0.7
FOOT_LENGTH_M = 0.32  # markers that are farther apart are on two feet
HIT_M = 0.012  # scatter of the centre of pressure about the foot it is under
NEAR_M = 0.05  # likewise of another trial that was cut at the same steps
NEAR_SHARE = 0.35  # of the samples of such a trial
CHANCE_SHARE = 0.4  # likewise that hit by chance: a foot is long
STRAY_SHARE = 0.1  # of samples far off in a right pair: unseen or missing markers
STRAY_M = 0.10  # how far these are off
ELSEWHERE_M = 0.30  # how far off forces of any other trial are: half a stride
SPARSE_M = 0.06  # feet with two markers may miss their loads by so much
SPARSE_NATS = -1.5  # then misses are one fault that repeats, not many
CONTRADICTION_NATS = -5.0  # log odds, 1 to 150; right pairs stay above -3
PIECE_S = 0.6  # a step; a longer load, standing or on one plate, is several
SAMPLES_PER_STEP = 2.0  # independent samples a step: where the foot is, and when
MOST_SAMPLES = 400  # more give no new information
MOMENTS_TRIED = 101  # other moments that are tried, up to half the recording away
FEWEST_MOVED_SHARE = 0.4  # of the samples that another moment must still have


FARTHEST_M = 1.0  # a load is no wronger for being farther from any foot


@dataclass(frozen=True)
class Feet:
    """Low markers over time: NaN where one is up in the air or unseen."""

    times: Float[np.ndarray, " frames"]  # [s]
    positions: Float[np.ndarray, "frames markers 2"]  # [m] x and z in the ground frame
    rate: float  # [Hz]
    seen: Bool[np.ndarray, " frames"]  # whether all of them show, up in the air or not
    are_two: bool  # or the markers of one foot alone


@dataclass(frozen=True)
class Loads:
    """Samples of loaded plates, each with the step it belongs to."""

    times: Float[np.ndarray, " samples"]  # [s]
    centres: Float[np.ndarray, "samples 2"]  # [m] x and z in the ground frame
    steps: Int[np.ndarray, " samples"]
    start: float  # [s] when the recording begins, loaded or not
    end: float  # [s]


@dataclass(frozen=True)
class Evidence:
    """What the contents say: `log_odds`, base e, for "of one recording"; 0 where they tell nothing."""

    log_odds: float
    off_m: float  # median distance between loads and feet; NaN where none could be compared


NOTHING = Evidence(0.0, float("nan"))


def feet_of(markers: Markers) -> Feet:
    """The low markers of a recording in which y points up."""
    height = markers.positions_ground[:, :, 1]
    seen = np.isfinite(height).any(axis=0)
    lowest = np.full(height.shape[1], np.inf)
    lowest[seen] = np.nanpercentile(height[:, seen], 2, axis=0)
    lowest[np.argsort(lowest, kind="stable")[MOST_MARKERS:]] = np.inf
    on_feet = lowest < lowest.min(initial=np.inf) + FOOT_HEIGHT_M
    positions = markers.positions_ground[:, on_feet][:, :, [0, 2]].copy()
    shown = np.isfinite(height[:, on_feet]).sum(axis=1)
    seen = shown >= max(1, FEET_SEEN_SHARE * shown.max(initial=0))
    are_two = seen.any() and _apart(positions[seen]) > FOOT_LENGTH_M
    with np.errstate(invalid="ignore"):
        positions[~(height[:, on_feet] - lowest[on_feet] <= LOW_M)] = np.nan
    return Feet(markers.times, positions, markers.rate, seen, bool(are_two))


def _apart(positions: Float[np.ndarray, "frames markers 2"]) -> float:
    """How far apart the farthest two markers typically are [m]; each frame shows at least one."""
    some = positions[:: max(1, len(positions) // MOST_SAMPLES)]
    one, other = np.triu_indices(some.shape[1])
    return float(np.median(np.nanmax(np.linalg.norm(some[:, one] - some[:, other], axis=2), axis=1)))


def loads_of(plates: Sequence[ForcePlate]) -> Loads | None:
    """The loaded samples of force plates; None where nothing ever stood on them, or where is unknown."""
    times, centres, steps, count = [], [], [], 0
    for plate in plates:
        force = np.abs(np.nan_to_num(plate.force_ground[:, 1]))
        least = max(JUDGED_N, LOADED_SHARE * float(force.max(initial=0.0)))
        loaded = np.flatnonzero((force > least) & np.isfinite(plate.cop_ground).all(axis=1))
        if not len(loaded):
            continue
        begins = np.r_[True, np.diff(loaded) > 1]
        step = np.cumsum(begins) - 1
        piece = (loaded - loaded[begins][step]) // max(1, round(PIECE_S * plate.rate))
        _, of_piece = np.unique(step * (piece.max() + 1) + piece, return_inverse=True)
        times.append(plate.times[loaded])
        centres.append(plate.cop_ground[loaded][:, [0, 2]])
        steps.append(of_piece + count)
        count += int(of_piece.max()) + 1
    if not times:
        return None
    every = max(1, sum(map(len, times)) // MOST_SAMPLES)
    return Loads(
        times=np.concatenate(times)[::every],
        centres=np.concatenate(centres)[::every],
        steps=np.concatenate(steps)[::every],
        start=min(float(plate.times[0]) for plate in plates),
        end=max(float(plate.times[-1]) for plate in plates),
    )


def under_feet(feet: Feet, loads: Loads) -> Evidence:
    """Weigh one recording against forces of another trial of such a person on such plates.

    Args:
        feet: of the markers.
        loads: of the plates, on the same clock.
    """
    compared = _compared(feet, loads)
    if compared is None:
        return NOTHING
    off = _distance(feet.positions[compared.frames], compared.centres)
    if not np.isfinite(off).any():
        return NOTHING
    off_m = float(np.median(np.where(np.isfinite(off), off, FARTHEST_M)))
    least = SPARSE_NATS if off_m < SPARSE_M else -np.inf
    if not feet.are_two:
        least = 0.0  # the other foot may be where the load is
    return Evidence(max(least, float((compared.worth * _gain(off)).sum())), off_m)


def evidence(feet: Feet, loads: Loads) -> Evidence:
    """The same, weighed against forces of another moment as well; the less favourable counts."""
    found = under_feet(feet, loads)
    compared = _compared(feet, loads)
    if found.log_odds <= 0 or compared is None:
        return found
    totals = _at_other_moments(feet, compared)[1]
    tried = totals[np.isfinite(totals)]
    if not len(tried):
        return found
    unlike_others = -np.log(np.mean(np.exp(np.minimum(tried - found.log_odds, 50))))
    return Evidence(min(found.log_odds, float(unlike_others)), found.off_m)


def best_lag_s(feet: Feet, loads: Loads) -> float | None:
    """By how much the loads would have to come later to lie under the feet [s]; None where no moment does."""
    compared = _compared(feet, loads)
    if compared is None:
        return None
    lags_s, totals = _at_other_moments(feet, compared)
    best = int(np.argmax(totals))
    return float(lags_s[best]) if totals[best] > 0 else None


@dataclass(frozen=True)
class _Compared:
    """The loads of frames on which the feet are seen."""

    frames: Int[np.ndarray, " samples"]
    centres: Float[np.ndarray, "samples 2"]
    worth: Float[np.ndarray, " samples"]


def _compared(feet: Feet, loads: Loads) -> _Compared | None:
    frames = np.round((loads.times - feet.times[0]) * feet.rate).astype(int)
    inside = _asked(frames, feet)
    if not inside.any():
        return None
    return _Compared(frames[inside], loads.centres[inside], _worth(loads.steps[inside]))


def _asked(frames: Int[np.ndarray, " samples"], feet: Feet) -> Bool[np.ndarray, " samples"]:
    """Of frames of the markers, which of them show the feet; none before or after the recording does."""
    inside = (frames >= 0) & (frames < len(feet.times))
    inside[inside] = feet.seen[frames[inside]]
    return inside


def _at_other_moments(
    feet: Feet, compared: _Compared
) -> tuple[Float[np.ndarray, " lags"], Float[np.ndarray, " lags"]]:
    """Lags [s], and how well the loads fit there; -inf where too few of them fall into the recording."""
    frames = len(feet.times)
    lags = np.unique(np.linspace(-frames / 2, frames / 2, MOMENTS_TRIED).round().astype(int))
    totals = np.full(len(lags), -np.inf)
    for k, lag in enumerate(lags):
        moved = compared.frames + lag
        known = _asked(moved, feet)
        if known.sum() >= FEWEST_MOVED_SHARE * len(moved):
            there = _gain(_distance(feet.positions[moved[known]], compared.centres[known]))
            worth = compared.worth[known]
            totals[k] = (worth * there).sum() * compared.worth.sum() / worth.sum()
    return lags / feet.rate, totals


def _worth(steps: Int[np.ndarray, " samples"]) -> Float[np.ndarray, " samples"]:
    """How much each sample counts: a step of usual length as much as `worth` independent ones."""
    counts = np.bincount(steps)
    usual = np.median(counts[counts > 0])
    of_step = SAMPLES_PER_STEP * np.minimum(1.0, counts / usual) / np.maximum(counts, 1)
    return of_step[steps]


def _gain(off: Float[np.ndarray, " samples"]) -> Float[np.ndarray, " samples"]:
    """Log ratio of a distance's density in a right pair to that in a pair of like trials."""
    far = np.minimum(off, FARTHEST_M)
    hit = _half_normal(far, HIT_M)
    right = (1 - STRAY_SHARE) * hit + STRAY_SHARE * _exponential(far, STRAY_M)
    rest = 1 - CHANCE_SHARE - NEAR_SHARE
    wrong = (
        CHANCE_SHARE * hit + NEAR_SHARE * _half_normal(far, NEAR_M) + rest * _exponential(far, ELSEWHERE_M)
    )
    return np.log(right / wrong)


def _half_normal(x: Float[np.ndarray, " n"], scale: float) -> Float[np.ndarray, " n"]:
    return np.sqrt(2 / np.pi) / scale * np.exp(-0.5 * np.square(x / scale))


def _exponential(x: Float[np.ndarray, " n"], scale: float) -> Float[np.ndarray, " n"]:
    return np.exp(-x / scale) / scale


def _distance(
    low: Float[np.ndarray, "samples markers 2"], centres: Float[np.ndarray, "samples 2"]
) -> Float[np.ndarray, " samples"]:
    """How far each centre of pressure is from the nearest line between two low markers of a foot [m]."""
    one, other = np.triu_indices(low.shape[1])
    start = low[:, one]
    along = low[:, other] - start
    squared = np.square(along).sum(axis=2)
    to_centre = centres[:, None] - start
    share = np.clip((to_centre * along).sum(axis=2) / np.where(squared > 0, squared, 1.0), 0.0, 1.0)
    away = np.linalg.norm(to_centre - share[:, :, None] * along, axis=2)
    of_one_foot = np.isfinite(away) & (squared < FOOT_LENGTH_M**2)
    return np.where(of_one_foot, away, np.inf).min(axis=1, initial=np.inf)
