"""The markers' trajectory of a long trial, window by window: no matrix of the trial's size is held."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from solver.common.frames_at_once import joined, overlapping
from solver.dynamics.force_prediction.marker_noise import MarkerNoise
from solver.dynamics.force_prediction.marker_posterior import MarkerPosterior, MarkerTrack, posterior_of
from solver.dynamics.trajectory.spline_basis import DEGREE, spline_basis
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.windows import Windows
from solver.kinematics.motion import Motion
from solver.skeleton.skeleton import Skeleton


@dataclass(frozen=True, eq=False)
class LongMarkerPosterior:
    """Mean trajectory; the factors of its precision are made again, one by one, when they are asked for."""

    track: MarkerTrack
    noise: MarkerNoise  # of the chosen smoothness
    parts: tuple[slice, ...]
    motion: Motion
    velocity: Float[np.ndarray, "frames dofs"]
    acceleration: Float[np.ndarray, "frames dofs"]
    coefficients: Float[np.ndarray, "coefficients dofs"]

    @property
    def smoothness(self) -> float:
        """That most of its parts chose."""
        return self.noise.smoothness[0]

    def wrench_covariance(
        self, measured_ground: Float[np.ndarray, "frames 6"], windows: Windows
    ) -> Float[np.ndarray, "rows rows"]:
        """Covariance of the required wrench's window means [N², N·N·m, (N·m)²].

        A pair of windows is told by the part in whose middle it lies; pairs that no part holds are farther
        apart than any marker's error lasts.

        Args:
            measured_ground: force [N] and moment about the ground origin [N·m].
            windows: what is averaged; rows are windows × six components.
        """
        covariance = np.zeros((windows.count, 6, windows.count, 6))
        ends = windows.start + windows.length
        borders = [(a.stop + b.start) / 2 for a, b in zip(self.parts[:-1], self.parts[1:], strict=True)]
        middles = (windows.centre[:, None] + windows.centre) / 2
        of_part = np.searchsorted(borders, middles, side="right")
        for k, part in enumerate(self.parts):
            inside = np.flatnonzero((windows.start >= part.start) & (ends <= part.stop))
            if not len(inside):
                continue
            own = Windows(part.stop - part.start, windows.start[inside] - part.start, windows.weights)
            told = self._made_again(part).wrench_covariance(measured_ground[part], own)
            told = told.reshape(len(inside), 6, len(inside), 6)
            six = np.arange(6)
            pairs = np.ix_(inside, six, inside, six)
            here = (of_part[np.ix_(inside, inside)] == k)[:, None, :, None]
            covariance[pairs] = np.where(here, told, covariance[pairs])
        return covariance.reshape(6 * windows.count, 6 * windows.count)

    def _made_again(self, part: slice) -> MarkerPosterior:
        first, frames = part.start // self.track.spacing, part.stop - part.start
        count = max(1, -(-(frames - 1) // self.track.spacing)) + DEGREE
        once = replace(self.noise, iterations=1)
        begin = self.coefficients[first : first + count]
        return posterior_of(self.track.part(part.start, part.stop), once, begin)


def trial_posterior(
    skeleton: Skeleton,
    observed_ground: Float[np.ndarray, "frames markers 3"],
    start: Motion,
    noise: MarkerNoise,
    settings: TrajectorySettings,
) -> MarkerPosterior | LongMarkerPosterior:
    """Of a trial of any length; arguments as of `marker_posterior`."""
    track = MarkerTrack(skeleton, observed_ground, start, noise, settings)
    parts = overlapping(
        start.frames,
        most=settings.whole_frames,
        window=settings.window_frames,
        shared=settings.overlap_frames,
        align=track.spacing,
    )
    if len(parts) == 1:
        return posterior_of(track, noise)
    told = [_spline(track.part(part.start, part.stop), noise) for part in parts]
    choices = sorted(smoothness for _, smoothness in told)
    chosen = replace(noise, smoothness=(choices[len(choices) // 2],))
    splines = [
        c if own == chosen.smoothness[0] else _spline(track.part(part.start, part.stop), chosen)[0]
        for (c, own), part in zip(told, parts, strict=True)
    ]
    c = joined(splines, [part.start // track.spacing for part in parts])
    basis = spline_basis(start.frames, start.rate, track.spacing)
    q, velocity, acceleration = (basis.evaluate(c, order) for order in range(3))
    return LongMarkerPosterior(track, chosen, tuple(parts), replace(start, q=q), velocity, acceleration, c)


def _spline(track: MarkerTrack, noise: MarkerNoise) -> tuple[Float[np.ndarray, "coefficients dofs"], float]:
    """Coefficients and smoothness; the factor is gone."""
    found = posterior_of(track, noise)
    return found.coefficients, found.smoothness
