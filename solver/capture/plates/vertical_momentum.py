"""What the plates read and how the trunk accelerates, through one and the same smoothing."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.capture.axes import TRUNK
from solver.capture.capture import ForcePlate, Markers
from solver.capture.plates.conditioning import gaps_filled, observed_at
from solver.capture.plates.force_settings import CONDITIONING, ConditioningSettings
from solver.capture.plates.plate_sign_settings import PLATE_SIGN, PlateSignSettings
from solver.capture.resampling import resample


@dataclass(frozen=True)
class VerticalMomentum:
    """Samples at which all plates were recorded, evenly spread."""

    readings_N: Float[np.ndarray, "samples plates"]  # upwards
    acceleration: Float[np.ndarray, " samples"]  # of the trunk, upwards [m/s²]; NaN where unseen
    agitation: Float[np.ndarray, " samples"]  # its size nearby [m/s²]


def vertical_momentum(
    plates: Sequence[ForcePlate],
    markers: Markers,
    settings: PlateSignSettings = PLATE_SIGN,
    conditioning: ConditioningSettings = CONDITIONING,
) -> VerticalMomentum:
    """Readings and acceleration at the markers' frames.

    The acceleration is the second derivative of cubics through a sliding window; the same window, seen as a
    weighted mean of accelerations, smooths the forces.
    """
    half = max(2, round(0.5 * settings.window_s * markers.rate))
    frames = markers.frames
    if frames <= 2 * half:
        return _unsmoothed(plates, markers, settings, conditioning)
    from scipy.signal import savgol_coeffs  # noqa: PLC0415 (slow to load, and rarely needed)

    second = savgol_coeffs(2 * half + 1, 3, deriv=2, delta=1 / markers.rate, use="dot")
    mean = np.cumsum(np.cumsum(second))[:-2]
    mean /= mean.sum()

    acceleration = np.full(frames, np.nan)
    acceleration[half:-half] = _acceleration(markers, second)
    readings = np.full((frames, len(plates)), np.nan)
    for k, plate in enumerate(plates):
        readings[half - 1 : frames - half + 1, k] = _slid(
            _at_frames(plate, markers.times, conditioning), mean
        )
    known = np.flatnonzero(np.isfinite(readings).all(axis=1))
    step = max(1, round(settings.spacing_s * markers.rate), -(-len(known) // settings.most_samples))
    chosen = known[step // 2 :: step]
    nearby = max(1, round(0.75 * settings.window_s * markers.rate))
    return VerticalMomentum(
        readings[chosen], acceleration[chosen], _size_nearby(acceleration, nearby)[chosen]
    )


def _acceleration(
    markers: Markers, second: Float[np.ndarray, " window"]
) -> Float[np.ndarray, " inner_frames"]:
    """Median over the trunk's markers [m/s²]; over the upper ones, where names do not tell."""
    height = markers.positions_ground[:, :, 1]
    seen_at_all = np.isfinite(height).any(axis=0)
    trunk = np.array([bool(TRUNK.search(name)) for name in markers.names]) & seen_at_all
    if trunk.sum() < 3 and seen_at_all.any():
        typical = np.full(len(trunk), -np.inf)
        typical[seen_at_all] = np.nanmedian(height[:, seen_at_all], axis=0)
        low, high = typical[seen_at_all].min(), typical.max()
        trunk = typical > low + 0.4 * (high - low)
    each = _slid(height[:, trunk], second)
    seen = np.isfinite(each).any(axis=1)
    middle = np.full(len(each), np.nan)
    middle[seen] = np.nanmedian(each[seen], axis=1)
    return middle


def _unsmoothed(
    plates: Sequence[ForcePlate],
    markers: Markers,
    settings: PlateSignSettings,
    conditioning: ConditioningSettings,
) -> VerticalMomentum:
    """What a recording shorter than the window holds: readings, and no acceleration."""
    readings = np.stack([_at_frames(plate, markers.times, conditioning) for plate in plates], axis=1)
    known = readings[np.isfinite(readings).all(axis=1)]
    few = known[:: max(1, round(settings.spacing_s * markers.rate))]
    unknown = np.full(len(few), np.nan)
    return VerticalMomentum(few, unknown, unknown)


def _at_frames(
    plate: ForcePlate, times: Float[np.ndarray, " frames"], conditioning: ConditioningSettings
) -> Float[np.ndarray, " frames"]:
    whole, recorded, _ = gaps_filled(plate, conditioning)
    vertical = resample(whole.force_ground[:, 1], plate.rate, plate.start_time, times)
    return np.where(observed_at(times, plate, recorded), vertical, np.nan)


def _slid(
    values: Float[np.ndarray, "frames *columns"], weights: Float[np.ndarray, " window"]
) -> Float[np.ndarray, "places *columns"]:
    return np.lib.stride_tricks.sliding_window_view(values, len(weights), axis=0) @ weights


def _size_nearby(values: Float[np.ndarray, " frames"], reach: int) -> Float[np.ndarray, " frames"]:
    """Root mean square over the known frames within reach."""
    known = np.isfinite(values)
    around = np.ones(2 * reach + 1)
    count = np.convolve(known, around, mode="full")[reach:-reach]
    squares = np.convolve(np.where(known, values, 0.0) ** 2, around, mode="full")[reach:-reach]
    return np.sqrt(squares / np.maximum(count, 1))
