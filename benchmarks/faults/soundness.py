"""Why a stretch counts as sound: what its raw files say, without a model of the body."""

from dataclasses import dataclass

import numpy as np
from scipy.signal import savgol_coeffs, savgol_filter

from benchmarks.faults.editor.fault import used_plates
from benchmarks.faults.editor.plates import GRAVITY, loads_of
from benchmarks.faults.editor.recording import Trial

FOOT_M = 0.16  # markers that come so near the lowest one are on feet
LAGS_S = np.arange(-0.1, 0.1001, 0.001)
BANDS = (0.06, 0.28, 0.55)  # of the highest marker's height: ankle, knee, hip
SHARES = (0.03, 0.09, 0.27, 0.61)  # of body mass: feet, shanks, thighs, what is above (arms with it)
WINDOW_S = 0.12  # of the smoothing that heights and forces share


@dataclass(frozen=True)
class Soundness:
    """Figures of one trial."""

    carried_kg: float  # by the mean force, less what the rise of the markers asks for
    unloaded_N: float  # the largest reading, in size, of an empty plate; 0 where none is ever empty
    off_m: float  # typical distance of a loaded centre of pressure from the nearest foot marker, level
    lag_s: float  # of the forces behind the markers' acceleration
    agreement: float  # correlation of both at that lag


def soundness(trial: Trial) -> Soundness:
    """Measure it."""
    total = loads_of(trial)
    times, acceleration = _acceleration(trial)
    inside = (trial.force_times >= times[0]) & (trial.force_times <= times[-1])
    mean_acceleration = np.interp(trial.force_times[inside], times, acceleration).mean()
    empty = [np.median(p.force[~p.loaded, 1]) for p in trial.plates if (~p.loaded).any()]
    lag, agreement = _lag(trial, times, acceleration)
    return Soundness(
        carried_kg=float(total[inside].mean() / (GRAVITY + mean_acceleration)),
        unloaded_N=float(max(map(abs, empty), default=0.0)),
        off_m=_off(trial),
        lag_s=lag,
        agreement=agreement,
    )


def _acceleration(trial: Trial) -> tuple[np.ndarray, np.ndarray]:
    """Upward acceleration of the body, from markers by height band: times and values [m/s²].

    Each band of a standing person, feet, shanks, thighs and what is above, weighs what people's segments do
    (de Leva 1996); a band without markers goes with the next above it.
    """
    height = trial.positions[:, :, 1]
    seen = np.isfinite(height).all(axis=0)
    height = height[:, seen] - np.nanmin(height)
    typical = np.median(height, axis=0)
    band = np.digitize(typical / typical.max(), BANDS)
    middle, weight = 0.0, 0.0
    for k, share in enumerate(SHARES):
        weight += share
        if (band == k).any():
            middle = middle + weight * (height[:, band == k] - typical[band == k]).mean(axis=1)
            weight = 0.0
    window = max(5, round(WINDOW_S * trial.rate) // 2 * 2 + 1)
    second = savgol_filter(middle, window, 3, deriv=2, delta=1 / trial.rate)
    edge = window // 2
    return trial.times[edge:-edge], second[edge:-edge]


def _lag(trial: Trial, times: np.ndarray, acceleration: np.ndarray) -> tuple[float, float]:
    mean = _mean_of_second_differences(WINDOW_S, trial.force_rate)
    smooth = np.convolve(loads_of(trial), mean, mode="same")
    core = slice(round(0.1 * trial.rate), -round(0.1 * trial.rate) or None)
    best = (0.0, -1.0)
    for lag in LAGS_S:
        force = np.interp(times[core] + lag, trial.force_times, smooth)
        agreement = np.corrcoef(force, acceleration[core])[0, 1]
        if agreement > best[1]:
            best = (float(lag), float(agreement))
    return best


def _mean_of_second_differences(window_s: float, rate: float) -> np.ndarray:
    """The weights with which a cubic's second derivative over a window averages the acceleration in it."""
    size = max(5, round(window_s * rate) // 2 * 2 + 1)
    second = savgol_coeffs(size, 3, deriv=2, use="dot")
    mean = np.cumsum(np.cumsum(second))[:-2]
    return mean / mean.sum()


def _off(trial: Trial) -> float:
    places = trial.positions[:, np.isfinite(trial.positions).any(axis=(0, 2))]
    low = np.nanmin(places[:, :, 1], axis=0) < np.nanmin(places[:, :, 1]) + FOOT_M
    feet = places[:, low][:, :, [0, 2]]
    distances = []
    for k in used_plates(trial):
        plate = trial.plates[k]
        pressed = plate.force[:, 1] > 0.3 * plate.force[:, 1].max()
        frames = np.searchsorted(trial.times, trial.force_times[pressed]).clip(0, len(trial.times) - 1)
        gaps = np.linalg.norm(feet[frames] - plate.pressure[pressed][:, None, [0, 2]], axis=2)
        distances.append(np.nanmin(gaps, axis=1))
    return float(np.median(np.concatenate(distances))) if distances else float("nan")
