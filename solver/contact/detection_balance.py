"""Newton and Euler for the whole body: the external wrench that its motion demands and no plate has measured."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.linalg import solveh_banded
from scipy.ndimage import uniform_filter1d

from solver.contact.detection_settings import DetectionSettings
from solver.skeleton.forward import cross

UP = 1  # y
FEWEST_FRAMES = 4  # that a third difference needs


@dataclass(frozen=True)
class BodyMotion:
    """What the balance needs to know of the motion; nothing of it is filtered."""

    com_ground: Float[np.ndarray, "frames 3"]  # [m]
    angular_momentum: Float[np.ndarray, "frames 3"]  # about the centre of mass [kg·m²/s]
    tracked: Bool[np.ndarray, " frames"]  # False: bridged, not measured
    rate: float  # [Hz]
    mass: float  # [kg]
    gravity: float  # [m/s²]

    @property
    def weight(self) -> float:
        """Of the body [N]."""
        return self.mass * self.gravity


@dataclass(frozen=True)
class Balance:
    """The missing wrench, demanded less measured, frame by frame, about the centre of mass."""

    force: Float[np.ndarray, "frames 3"]  # [N]
    moment: Float[np.ndarray, "frames 3"]  # [N·m]
    demanded: Float[np.ndarray, " frames"]  # [N] support, m (z̈ + g)
    noise: Float[np.ndarray, " frames"]  # [N] standard deviation of the vertical force
    moment_noise: Float[np.ndarray, " frames"]  # [N·m] of the horizontal moments
    com_ground: Float[np.ndarray, "frames 3"]  # [m]

    @property
    def missing(self) -> Float[np.ndarray, " frames"]:
        """Missing support [N]."""
        return self.force[:, UP]

    def pressed_point(self, height: Float[np.ndarray, " frames"]) -> Float[np.ndarray, "frames 2"]:
        """Where the missing force presses on a surface of that height [m]: x and z; of no meaning without one.

        A force F through r from the centre of mass and a moment about the vertical make
        M_x = r_y F_z − r_z F_y and M_z = r_x F_y − r_y F_x.
        """
        below = height - self.com_ground[:, UP]
        pressing = np.where(np.abs(self.missing) > 1.0, self.missing, np.nan)
        x = self.com_ground[:, 0] + (self.moment[:, 2] + below * self.force[:, 0]) / pressing
        z = self.com_ground[:, 2] + (below * self.force[:, 2] - self.moment[:, 0]) / pressing
        return np.column_stack([x, z])


def external_balance(
    motion: BodyMotion,
    measured_ground: Float[np.ndarray, "frames 6"],
    *,
    cutoff_Hz: float,
    settings: DetectionSettings,
) -> Balance:
    """How much force and moment the motion asks for beyond the measured ones.

    The measured wrench is integrated and subtracted from the motion: e = x − ∬(F/m − g), and likewise the
    angular momentum. Where all forces were measured e is a parabola and the markers' noise, however hard the
    impact; where some are missing, m ë is what is missing. So only e is smoothed and differentiated (Whittaker's
    smoother: least squares with a penalty on the third difference), never motion and forces with filters
    that must match.

    Args:
        motion: of the whole body.
        measured_ground: sum over the feet of force [N] and moment about the ground origin [N·m], not filtered.
        cutoff_Hz: of the smoothing.
        settings: thresholds.
    """
    rate, mass = motion.rate, motion.mass
    force = measured_ground[:, :3]
    moment = measured_ground[:, 3:] - cross(motion.com_ground, force)
    push = force / mass
    push[:, UP] -= motion.gravity
    unexplained = motion.com_ground - _integral(_integral(push, rate), rate)
    smooth = _Smoother(motion.tracked, rate, cutoff_Hz)
    missing = mass * smooth.derivative(unexplained, 2)
    missing_moment = smooth.derivative(motion.angular_momentum - _integral(moment, rate), 1)
    acceleration = smooth.derivative(motion.com_ground, 2)[:, UP]
    bounce = mass * _level(acceleration, rate, settings.bounce_window_s)
    return Balance(
        force=missing,
        moment=missing_moment,
        demanded=mass * (acceleration + motion.gravity),
        noise=np.hypot(settings.balance_noise * motion.weight, settings.bounce_noise * bounce),
        moment_noise=settings.moment_noise_m * (motion.weight + bounce),
        com_ground=motion.com_ground,
    )


def _integral(values: Float[np.ndarray, "frames 3"], rate: float) -> Float[np.ndarray, "frames 3"]:
    """From zero on, by trapezia."""
    steps = (values[:-1] + values[1:]) / (2 * rate)
    return np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])


class _Smoother:
    """Whittaker's smoother on a trial's frames; a parabola passes unchanged, a wave at the cutoff by half."""

    def __init__(self, seen: Bool[np.ndarray, " frames"], rate: float, cutoff_Hz: float) -> None:
        frames = len(seen)
        self.seen, self.rate = seen, rate
        self.time = (np.arange(frames) - frames / 2) / rate
        self.band = (rate / (2 * np.pi * cutoff_Hz)) ** 6 * _third_difference_band(frames)
        self.band[-1] += seen

    def derivative(self, values: Float[np.ndarray, "frames 3"], order: int) -> Float[np.ndarray, "frames 3"]:
        """First or second derivative of the smoothed series."""
        if self.seen.sum() < FEWEST_FRAMES:
            return np.zeros_like(values)
        parabola = np.polyfit(self.time[self.seen], values[self.seen], 2)
        trend = [np.polyval(np.polyder(p, k), self.time) for k in (0, order) for p in parabola.T]
        rest = np.where(self.seen[:, None], values - np.column_stack(trend[:3]), 0.0)
        smooth = solveh_banded(self.band, rest)
        if order == 1:
            steep = np.gradient(smooth, axis=0) * self.rate
        else:
            steep = np.pad(np.diff(smooth, 2, axis=0), ((1, 1), (0, 0)), mode="edge") * self.rate**2
        return steep + np.column_stack(trend[3:])


def _third_difference_band(frames: int) -> Float[np.ndarray, "4 frames"]:
    """DᵀD of the third difference in LAPACK's upper band form."""
    difference = (-1.0, 3.0, -3.0, 1.0)
    band = np.zeros((4, frames))
    for i in range(4):
        for j in range(i, 4):
            band[3 - (j - i), j : max(j, frames - 3 + j)] += difference[i] * difference[j]
    return band


def _level(values: Float[np.ndarray, " frames"], rate: float, window_s: float) -> Float[np.ndarray, " frames"]:
    """Root mean square over a sliding window."""
    return np.sqrt(uniform_filter1d(values**2, max(1, round(window_s * rate)), mode="nearest"))
