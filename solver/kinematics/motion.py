"""Generalized coordinates over time, and the one place where their derivatives are made.

A motion at other times than those that it was recorded at.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float
from scipy.interpolate import BSpline, make_interp_spline

from solver.common.errors import FitError
from solver.common.filters import low_pass
from solver.common.true_runs import runs


@dataclass(frozen=True)
class Motion:
    """Generalized coordinates of one trial.

    Velocities and accelerations are those of the natural quintic spline through q: three-point differences
    cost 5 N RMS in running at 100 Hz, and the spline is what OpenSim's inverse dynamics differentiates.

    Frames without a pose are NaN, a coordinate where nothing tells it, and so is what is derived there.
    """

    dofs: tuple[str, ...]
    q: Float[np.ndarray, "frames dofs"]  # [rad or m] NaN where it is not known
    rate: float  # [Hz]
    start_time: float = 0.0  # [s]
    # [rad or m] with guesses where q leaves a joint out
    whole_q: Float[np.ndarray, "frames dofs"] | None = None

    @property
    def frames(self) -> int:
        """Number of frames."""
        return self.q.shape[0]

    @property
    def times(self) -> Float[np.ndarray, " frames"]:
        """Time of each frame on the recording's clock [s]."""
        return self.start_time + np.arange(self.frames) / self.rate

    @cached_property
    def posed(self) -> Bool[np.ndarray, " frames"]:
        """Frames that have a pose."""
        return np.isfinite(self.q).any(axis=1)

    def filled(self) -> "Motion":
        """With a pose on every frame: lines between known values, the nearest one at the ends, else zero."""
        values = self.q if self.whole_q is None else self.whole_q
        told = np.isfinite(values)
        if told.all() or not told.any():
            return self if self.whole_q is None else replace(self, q=values, whole_q=None)
        frames, q = np.arange(self.frames), np.where(told, values, 0.0)
        for known, column in zip(told.T, q.T, strict=True):
            if known.any():
                column[~known] = np.interp(frames[~known], frames[known], column[known])
        return replace(self, q=q, whole_q=None)

    @cached_property
    def _splines(self) -> list[tuple[int, int, BSpline]]:
        """One for each stretch of frames with a pose, and its frames."""
        q = self.filled().q
        return [(a, b, _spline(np.arange(a, b) / self.rate, q[a:b])) for a, b in runs(self.posed)]

    def derivative(self, order: int) -> Float[np.ndarray, "frames dofs"]:
        """The spline's derivative of that order at the frames [rad/sⁿ or m/sⁿ]."""
        return self.at(np.arange(self.frames) / self.rate, order)

    def at(self, seconds: Float[np.ndarray, " times"], order: int = 0) -> Float[np.ndarray, "times dofs"]:
        """The spline's derivative of that order at any times within the trial [rad/sⁿ or m/sⁿ].

        NaN where the nearest frame tells nothing.

        Args:
            seconds: since the first frame [s].
            order: 0 for the spline itself.
        """
        nearest = np.clip(np.round(np.asarray(seconds) * self.rate), 0, self.frames - 1).astype(int)
        result = np.full((len(nearest), self.q.shape[1]), np.nan)
        for start, end, spline in self._splines:
            there = (nearest >= start) & (nearest < end)
            result[there] = spline(np.asarray(seconds)[there], nu=order)
        result[~np.isfinite(self.q[nearest])] = np.nan
        return result

    @cached_property
    def velocity(self) -> Float[np.ndarray, "frames dofs"]:
        """First derivative [rad/s or m/s]."""
        return self.derivative(1)

    @cached_property
    def acceleration(self) -> Float[np.ndarray, "frames dofs"]:
        """Second derivative [rad/s² or m/s²]."""
        return self.derivative(2)

    def without_derivatives(self) -> "Motion":
        """The same motion; what is asked of it here is not kept in memory as long as this one lives."""
        return replace(self)

    def between(self, start: int, end: int) -> "Motion":
        """Frames `start` to `end` (excluded) as a motion of their own."""
        whole_q = None if self.whole_q is None else self.whole_q[start:end]
        start_time = self.start_time + start / self.rate
        return replace(self, q=self.q[start:end], start_time=start_time, whole_q=whole_q)

    def low_passed(self, cutoff_Hz: float, order: int = 3) -> "Motion":
        """The motion after a zero-phase Butterworth filter; forces must pass the same one.

        A cutoff at or above the Nyquist frequency leaves it as it is.
        """
        smooth = low_pass(self.filled().q, self.rate, cutoff_Hz, order)
        whole_q = None if self.whole_q is None else smooth
        return replace(self, q=np.where(np.isfinite(self.q), smooth, np.nan), whole_q=whole_q)


def _spline(times: Float[np.ndarray, " frames"], q: Float[np.ndarray, "frames dofs"]) -> BSpline:
    degree = min(5, len(times) - 1)
    if len(times) < 8:
        return make_interp_spline(times, q, k=degree)
    nothing = np.zeros(q.shape[1])
    natural_end = [(3, nothing), (4, nothing)]  # a quadratic beyond the ends
    return make_interp_spline(times, q, k=degree, bc_type=(natural_end, natural_end))


def _none() -> Float[np.ndarray, "0 0"]:
    return np.zeros((0, 0))


@dataclass(frozen=True)
class ResampledMotion(Motion):
    """Samples of a spline: velocities and accelerations are that spline's, not those of one through q."""

    qd: Float[np.ndarray, "frames dofs"] = field(default_factory=_none)  # [rad/s or m/s]
    qdd: Float[np.ndarray, "frames dofs"] = field(default_factory=_none)  # [rad/s² or m/s²]

    @property
    def velocity(self) -> Float[np.ndarray, "frames dofs"]:
        """First derivative [rad/s or m/s]."""
        return self.qd

    @property
    def acceleration(self) -> Float[np.ndarray, "frames dofs"]:
        """Second derivative [rad/s² or m/s²]."""
        return self.qdd

    def low_passed(self, cutoff_Hz: float, order: int = 3) -> Motion:
        """Refused: a filter comes before other times do.

        Raises:
            FitError: always.
        """
        raise FitError(f"filter at {cutoff_Hz:g} Hz before the motion is resampled, order {order}.")


def resampled(motion: Motion, rate: float, frames: int) -> ResampledMotion:
    """The spline through a motion, and its derivatives, at equally spaced times from its first frame on.

    Args:
        motion: as recorded.
        rate: of the new times [Hz].
        frames: how many; the last one lies within the motion.
    """
    seconds = np.arange(frames) / rate
    q, qd, qdd = (motion.at(seconds, order) for order in range(3))
    return ResampledMotion(motion.dofs, q, rate, motion.start_time, qd=qd, qdd=qdd)
