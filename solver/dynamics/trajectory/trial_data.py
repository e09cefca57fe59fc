"""What trials give to the trajectory fit: measurements, and what else may act on the body."""

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from jaxtyping import Bool, Float

from solver.dynamics.trajectory.marker_error_levels import MarkerErrorLevels
from solver.dynamics.trajectory.spline_basis import DEGREE
from solver.kinematics.motion import Motion

Part = TypeVar("Part", Motion, np.ndarray)


@dataclass(frozen=True)
class TrialLevels:
    """Of a whole trial."""

    marker_errors: MarkerErrorLevels
    pull: Float[np.ndarray, " dofs"]  # precision of the pull to the marker fit [1/rad²]
    jerk: Float[np.ndarray, " dofs"]  # [rad/s³ or m/s³]


@dataclass(frozen=True)
class TrialData:
    """What one trial gives to the fit; everything at the markers' frames."""

    observed_ground: Float[np.ndarray, "frames markers 3"]  # [m] NaN where unseen; the skeleton's markers
    wrench_ground: Float[np.ndarray, "frames 6"]  # [N, N·m about the ground origin] of all feet together
    counts: Bool[np.ndarray, " frames"]  # False on frames of U
    start: Motion  # the marker fit
    initial: Motion | None = None  # where the search begins; None: at the marker fit
    spline: Float[np.ndarray, "coefficients dofs"] | None = None  # of an earlier fit: begin there instead
    other_start: Motion | None = None  # begin here instead, where the cost is lower than there
    predicted_ground: Float[np.ndarray, "frames 6"] | None = (
        None  # like the wrench, for frames of U; None: free
    )
    extra_wrench_ground: Float[np.ndarray, "frames 6"] | None = None  # acts beside the feet's; None: nothing
    extra_columns_ground: Float[np.ndarray, "frames 6 extra"] | None = None  # likewise per x; None: zero
    levels: TrialLevels | None = None  # of the trial that this is a part of; None: its own
    by_video: bool = False  # whether the markers' errors wander, as those of a markerless system do
    held_ends: tuple[bool, bool] = (False, False)  # first, last: whether the spline stays where it is there

    def part(self, start: int, end: int, spacing: int, *, held: bool = False) -> "TrialData":
        """Frames `start` to `end` (excluded) as a trial of their own, with the weights of the whole.

        Args:
            start: a multiple of the spacing.
            end: at most the number of frames.
            spacing: of the spline's knots [frames].
            held: the spline stays as it is at ends that are not the trial's, where the last frame is on a
                knot.
        """

        def cut(whole: Part | None) -> Part | None:
            if isinstance(whole, Motion):
                return whole.between(start, end)
            return None if whole is None else whole[start:end]

        first, pieces = start // spacing, max(1, -(-(end - start - 1) // spacing))
        return replace(
            self,
            observed_ground=self.observed_ground[start:end],
            wrench_ground=self.wrench_ground[start:end],
            counts=self.counts[start:end],
            start=self.start.between(start, end),
            initial=cut(self.initial),
            spline=None if self.spline is None else self.spline[first : first + pieces + DEGREE],
            other_start=cut(self.other_start),
            predicted_ground=cut(self.predicted_ground),
            extra_wrench_ground=cut(self.extra_wrench_ground),
            extra_columns_ground=cut(self.extra_columns_ground),
            held_ends=(held and start > 0, held and end < len(self.counts)),
        )

    def with_fixed_extra(self, x: Float[np.ndarray, " extra"]) -> "TrialData":
        """The same where x is known: no columns are left."""
        if self.extra_columns_ground is None:
            return self
        wrench = self.extra_columns_ground @ x
        if self.extra_wrench_ground is not None:
            wrench = wrench + self.extra_wrench_ground
        return replace(self, extra_wrench_ground=wrench, extra_columns_ground=None)


@dataclass(frozen=True)
class ExtraParameters:
    """x of the trials' extra columns: scatter before the data, and where the search begins."""

    prior_std: Float[np.ndarray, " extra"]
    start: Float[np.ndarray, " extra"]

    @classmethod
    def none(cls) -> "ExtraParameters":
        """Nothing extra."""
        return cls(np.zeros(0), np.zeros(0))
