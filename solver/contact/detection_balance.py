"""Newton and Euler for the whole body: the external wrench that its motion demands, beside the measured."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.linalg import solveh_banded
from scipy.ndimage import uniform_filter1d

from solver.common.true_runs import runs
from solver.common.white_noise import white_noise_together
from solver.skeleton.forward import cross

BALANCE_NOISE = 0.03  # of body weight: what vertical balance leaves unexplained in quiet movement
BOUNCE_NOISE = 0.08  # of m·a: what soft tissue and a stiff trunk leave unexplained besides
BOUNCE_WINDOW_S = 0.2  # [s] the level of m·a is that of the last step or so
MOMENT_NOISE_M = 0.02  # [m] of weight and m·a: what the balance of moments leaves unexplained
# [m/s²] by which the body's acceleration changes from one frame to the next: landing 3 g, markers that
# vanish or come back 20 g and more
JUMP_M_S2 = 100.0
# [m] of such a jump, and standard deviation of what stays of it: other markers, another pelvis
JUMP_OFFSET_M = 0.005

UP = 1  # y, among the three components of a force
FEWEST_FRAMES = 4  # that a third difference needs
SETTLED_PERIODS = 4.0  # periods of the cutoff after which an end of the trial is forgotten
# likewise after which a force is: Whittaker's slowest wave, exp(−π t·cutoff), is 1e-11 there
FADED_PERIODS = 8.0


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


def jumps(com_ground: Float[np.ndarray, "frames 3"], rate: float) -> Bool[np.ndarray, " frames"]:
    """Frames on which the centre of mass moves as no body can: markers that vanish or change places move it.

    Args:
        com_ground: not filtered [m].
        rate: [Hz].
    """
    found = np.zeros(len(com_ground), dtype=bool)
    if len(com_ground) < FEWEST_FRAMES:
        return found
    change = np.linalg.norm(np.diff(com_ground, 3, axis=0), axis=1)
    most = max(JUMP_M_S2 / rate**2, 2.0 * JUMP_OFFSET_M)
    for first in range(FEWEST_FRAMES):
        found[first : first + len(change)] |= change > most
    return found


class WholeBody:
    """Required and measured wrenches about the centre of mass, both through one and the same smoother.

    Whittaker's smoother: least squares with a penalty on the third difference. Motion is smoothed and then
    differentiated; a wrench is integrated, smoothed and differentiated likewise. So their difference is that
    of e = x − ∬(F/m − g): where all forces were measured e is a parabola and the markers' noise, however
    hard the impact, and a parabola passes unchanged, also at the ends of the trial.

    Attributes:
        required: force [N] and moment about the centre of mass [N·m] that gravity and inertia ask for.
        noise: standard deviation of the vertical force that a complete measurement leaves unexplained [N].
        moment_noise: likewise of horizontal moments [N·m].
        jumping: frames that are bridged, because markers that vanished or came back moved the body.
    """

    def __init__(self, motion: BodyMotion, cutoff_Hz: float) -> None:
        self.motion = motion
        self.jumping: Bool[np.ndarray, " frames"] = motion.tracked & jumps(motion.com_ground, motion.rate)
        self._smoother = _Smoother(motion.tracked & ~self.jumping, motion.rate, cutoff_Hz)
        acceleration = self._smoother.derivative(motion.com_ground, 2)
        turning = self._smoother.derivative(motion.angular_momentum, 1)
        self.required: Float[np.ndarray, "frames 6"] = np.hstack([motion.mass * acceleration, turning])
        self.required[:, UP] += motion.weight
        bounce = motion.mass * _level(acceleration[:, UP], motion.rate, BOUNCE_WINDOW_S)
        self.noise = np.hypot(BALANCE_NOISE * motion.weight, BOUNCE_NOISE * bounce)
        self.moment_noise = MOMENT_NOISE_M * (motion.weight + bounce)
        jitter = motion.mass * white_noise_together(motion.com_ground[:, [UP]])
        self.noise = np.hypot(self.noise, jitter * self._smoother.noise_gain(2))
        turning_jitter = white_noise_together(motion.angular_momentum[:, [0, 2]])
        self.moment_noise = np.hypot(self.moment_noise, turning_jitter * self._smoother.noise_gain(1))
        offset = motion.mass * JUMP_OFFSET_M
        self.noise = np.hypot(self.noise, offset * self._smoother.offset_gain(self.jumping))

    def passed(self, wrench_ground: Float[np.ndarray, "frames 6"]) -> Float[np.ndarray, "frames 6"]:
        """A wrench [N, N·m about the ground origin] as the balance sees it: about the centre of mass."""
        return _passed(self._smoother, self.motion.com_ground, wrench_ground)

    def passed_stretch(
        self, start: int, wrench_ground: Float[np.ndarray, "some 6"]
    ) -> tuple[slice, Float[np.ndarray, "near 6"]]:
        """Likewise a wrench that acts from one frame on and for so many: the frames that feel it, and what.

        Before and behind it e is a straight line, so what passes fades within a few periods of the cutoff.
        """
        end = start + len(wrench_ground)
        near = self._smoother.near(start, end)
        padded = np.pad(wrench_ground, ((start - near.start, near.stop - end), (0, 0)))
        felt = _passed(self._smoother.part(near), self.motion.com_ground[near], padded)
        first = int(near.start > 0)  # a slope is one-sided, so coarse, where a part ends
        last = len(felt) - int(near.stop < len(self.motion.com_ground))
        return slice(near.start + first, near.start + last), felt[first:last]

    def pressed_point(
        self, wrench: Float[np.ndarray, "frames 6"], height: Float[np.ndarray, " frames"]
    ) -> Float[np.ndarray, "frames 2"]:
        """Where a wrench about the centre of mass presses on a surface of that height: x and z [m].

        A force F at r from the centre of mass and a moment about the vertical make
        M_x = r_y F_z − r_z F_y and M_z = r_x F_y − r_y F_x. Without a force the point is NaN.
        """
        com = self.motion.com_ground
        below = height - com[:, UP]
        pressing = np.where(np.abs(wrench[:, UP]) > 1.0, wrench[:, UP], np.nan)
        x = com[:, 0] + (wrench[:, 5] + below * wrench[:, 0]) / pressing
        z = com[:, 2] + (below * wrench[:, 2] - wrench[:, 3]) / pressing
        return np.column_stack([x, z])


def _passed(
    smoother: "_Smoother",
    com_ground: Float[np.ndarray, "frames 3"],
    wrench_ground: Float[np.ndarray, "frames 6"],
) -> Float[np.ndarray, "frames 6"]:
    rate, force = smoother.rate, wrench_ground[:, :3]
    moment = wrench_ground[:, 3:] - cross(com_ground, force)
    twice = _integral(_integral(force, rate), rate)
    return np.hstack([smoother.derivative(twice, 2), smoother.derivative(_integral(moment, rate), 1)])


def _integral(values: Float[np.ndarray, "frames 3"], rate: float) -> Float[np.ndarray, "frames 3"]:
    """From zero on, by trapezia."""
    steps = (values[:-1] + values[1:]) / (2 * rate)
    return np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])


class _Smoother:
    """Whittaker's smoother on a trial's frames; a wave at the cutoff passes by half."""

    def __init__(self, seen: Bool[np.ndarray, " frames"], rate: float, cutoff_Hz: float) -> None:
        frames = len(seen)
        self.seen, self.rate, self.cutoff_Hz = seen, rate, cutoff_Hz
        self.time = (np.arange(frames) - frames / 2) / rate
        self.band = (rate / (2 * np.pi * cutoff_Hz)) ** 6 * _third_difference_band(frames)
        self.band[-1] += seen

    def derivative(
        self, values: Float[np.ndarray, "frames columns"], order: int
    ) -> Float[np.ndarray, "frames columns"]:
        """First or second derivative of the smoothed series."""
        if self.seen.sum() < FEWEST_FRAMES:
            return np.zeros_like(values)
        parabola = np.polyfit(self.time[self.seen], values[self.seen], 2).T
        trend, slope = (
            np.column_stack([np.polyval(np.polyder(p, k), self.time) for p in parabola]) for k in (0, order)
        )
        smooth = solveh_banded(self.band, np.where(self.seen[:, None], values - trend, 0.0))
        if order == 1:
            return slope + np.gradient(smooth, axis=0) * self.rate
        bend = np.pad(np.diff(smooth, 2, axis=0), ((1, 1), (0, 0)), mode="edge")
        return slope + bend * self.rate**2

    def offset_gain(self, jumping: Bool[np.ndarray, " frames"]) -> Float[np.ndarray, " frames"]:
        """Standard deviation of the second derivative where the series may move by one in each jump."""
        square = np.zeros(len(self.seen))
        for start, end in runs(jumping):
            near = self.near(start, end)
            step = np.arange(near.start, near.stop)[:, None] >= (start + end) / 2
            square[near] += self.part(near).derivative(step.astype(float), 2)[:, 0] ** 2
        return np.sqrt(square)

    def near(self, start: int, end: int) -> slice:
        """Frames that feel what happens on some: as many seen ones on either side as it takes to fade."""
        reach = max(FEWEST_FRAMES, round(FADED_PERIODS * self.rate / self.cutoff_Hz))
        seen = np.flatnonzero(self.seen)
        before, behind = np.searchsorted(seen, start) - reach, np.searchsorted(seen, end) + reach
        return slice(
            int(seen[before]) if before >= 0 else 0,
            int(seen[behind - 1]) + 1 if behind <= len(seen) else len(self.seen),
        )

    def part(self, frames: slice) -> "_Smoother":
        """The smoother of a trial of these frames only."""
        return _Smoother(self.seen[frames], self.rate, self.cutoff_Hz)

    def noise_gain(self, order: int) -> Float[np.ndarray, " frames"]:
        """Standard deviation of a derivative where the series has white noise of one: larger at the ends."""
        frames = len(self.seen)
        enough = min(frames, 2 * round(SETTLED_PERIODS * self.rate / self.cutoff_Hz) + 1)
        short = _Smoother(np.ones(enough, dtype=bool), self.rate, self.cutoff_Hz)
        gain = np.linalg.norm(short.derivative(np.eye(enough), order), axis=1)
        middle = enough // 2
        return np.concatenate([gain[:middle], np.full(frames - enough, gain[middle]), gain[middle:]])


def _third_difference_band(frames: int) -> Float[np.ndarray, "4 frames"]:
    """DᵀD of the third difference in LAPACK's upper band form."""
    difference = (-1.0, 3.0, -3.0, 1.0)
    band = np.zeros((4, frames))
    for i in range(4):
        for j in range(i, 4):
            band[3 - (j - i), j : max(j, frames - 3 + j)] += difference[i] * difference[j]
    return band


def _level(
    values: Float[np.ndarray, " frames"], rate: float, window_s: float
) -> Float[np.ndarray, " frames"]:
    """Root mean square over a sliding window."""
    square = uniform_filter1d(values**2, max(1, round(window_s * rate)), mode="nearest")
    return np.sqrt(np.maximum(square, 0.0))  # a running sum may end a hair below zero
