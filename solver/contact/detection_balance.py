"""Vertical balance of the whole body: the support that its motion demands and no plate has measured."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.linalg import solveh_banded
from scipy.ndimage import uniform_filter1d

from solver.contact.detection_settings import DetectionSettings


@dataclass(frozen=True)
class Balance:
    """Support in newtons, frame by frame."""

    missing: Float[np.ndarray, " frames"]  # [N] demanded less measured
    demanded: Float[np.ndarray, " frames"]  # [N] m (z̈ + g)
    error: Float[np.ndarray, " frames"]  # [N] standard deviation of `missing`, the mass' error included


def support_balance(
    height: Float[np.ndarray, " frames"],
    support: Float[np.ndarray, " frames"],
    seen: Bool[np.ndarray, " frames"],
    *,
    rate: float,
    mass: float,
    gravity: float,
    mass_error: float,
    settings: DetectionSettings,
) -> Balance:
    """How much vertical force the centre of mass' motion asks for beyond the measured one.

    The measured force is integrated twice and subtracted from the height: e = z − ∬(F/m − g). Where all
    forces were measured e is a parabola and the markers' noise, however hard the impact; where some are
    missing, m ë is what is missing. So only e is smoothed and differentiated (Whittaker's smoother: least
    squares with a penalty on the third difference), never z and F with filters that must match.

    Args:
        height: of the centre of mass [m], not filtered.
        support: vertical force that all feet together were measured to carry [N], not filtered.
        seen: frames whose height is measured; the others are bridged.
        rate: [Hz].
        mass: of the person [kg].
        gravity: its magnitude [m/s²].
        mass_error: relative standard deviation of mass and plates' gains.
        settings: thresholds.
    """
    weight = mass * gravity
    push = support / mass - gravity
    unexplained = height - _integrated_twice(push, rate)
    acceleration = _second_derivative(unexplained, seen, rate, settings.balance_cutoff_Hz)
    missing = mass * acceleration
    measured = _second_derivative(_integrated_twice(push, rate), seen, rate, settings.balance_cutoff_Hz)
    motion = acceleration + measured  # [m/s²] of the centre of mass, smoothed alike
    bounce = mass * _level(motion, rate, settings.bounce_window_s)
    demanded = mass * (motion + gravity)
    error = np.sqrt(
        (settings.balance_noise * weight) ** 2
        + (settings.bounce_noise * bounce) ** 2
        + (mass_error * weight) ** 2
    )
    return Balance(missing=missing, demanded=demanded, error=error)


def _integrated_twice(acceleration: Float[np.ndarray, " frames"], rate: float) -> Float[np.ndarray, " frames"]:
    """Position from rest of a piecewise linear acceleration."""
    before, after = acceleration[:-1], acceleration[1:]
    velocity = np.concatenate([[0.0], np.cumsum((before + after) / (2 * rate))])
    steps = velocity[:-1] / rate + (2 * before + after) / (6 * rate**2)
    return np.concatenate([[0.0], np.cumsum(steps)])


def _second_derivative(
    values: Float[np.ndarray, " frames"], seen: Bool[np.ndarray, " frames"], rate: float, cutoff_Hz: float
) -> Float[np.ndarray, " frames"]:
    """Of the smoothed series; a parabola passes unchanged, a wave at the cutoff by half."""
    frames = len(values)
    if frames < 4 or seen.sum() < 4:
        return np.zeros(frames)
    time = (np.arange(frames) - frames / 2) / rate
    parabola = np.polyfit(time[seen], values[seen], 2)
    rest = np.where(seen, values - np.polyval(parabola, time), 0.0)
    penalty = (rate / (2 * np.pi * cutoff_Hz)) ** 6
    band = penalty * _third_difference_band(frames)
    band[-1] += seen
    smooth = solveh_banded(band, rest)
    second = np.diff(smooth, 2) * rate**2
    return np.pad(second, 1, mode="edge") + 2 * parabola[0]


def _third_difference_band(frames: int) -> Float[np.ndarray, "4 frames"]:
    """DᵀD of the third difference in LAPACK's upper band form."""
    difference = (-1.0, 3.0, -3.0, 1.0)
    band = np.zeros((4, frames))
    for i in range(4):
        for j in range(i, 4):
            band[3 - (j - i), j : frames - 3 + j] += difference[i] * difference[j]
    return band


def _level(values: Float[np.ndarray, " frames"], rate: float, window_s: float) -> Float[np.ndarray, " frames"]:
    """Root mean square over a sliding window."""
    return np.sqrt(uniform_filter1d(values**2, max(1, round(window_s * rate)), mode="nearest"))
