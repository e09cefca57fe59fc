"""How fast the part of each sole that may touch the ground slips over it, and the person's pace."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline
from scipy.ndimage import uniform_filter1d
from scipy.spatial.distance import cdist

from solver.common.filters import low_pass
from solver.common.frames_at_once import FRAMES_AT_ONCE, by_frames
from solver.gait.settings import STEPS_PER_S, GaitSettings

LOW_M = 0.02  # [m] the part of a sole that may touch: this near its lowest corner
SURFACE_LOW_SHARE = 0.35  # of the time, in which a foot is lowest: it then stands, also in runs
SURFACE_SPREAD_M_S = 0.2  # [m/s] by which standing soles differ from the surface
SURFACE_WINDOW_S = 0.35  # [s] over which a belt keeps its speed; about half a step
STILL_M_S = 0.15  # [m/s] a slower surface stands still: no belt is so slow
PACE_WINDOW_S = 1.0  # [s] about a stride of a walk

MOST_SAMPLES = 1500  # of soles' velocities; more tell no more of the surface's
GRID_S = 0.1
ROUNDS = 10  # of mean shift, which settles in a few
SPLINE_REACH_FRAMES = 64  # frames beyond which a cubic spline feels nothing of another: 0.27 a frame


@dataclass(frozen=True)
class FootMotion:
    """Both feet on a fine grid of times."""

    times: Float[np.ndarray, " steps"]  # [s]
    slip: Float[np.ndarray, "steps feet"]  # [m/s] of the slowest low corner against the surface
    surface: Float[np.ndarray, "steps 2"]  # [m/s] velocity of the ground: x, z; zero on a floor
    pace: Float[np.ndarray, " steps"]  # [m/s] of the body over the surface
    sole: Float[np.ndarray, "steps feet 2"]  # [m/s] x, z velocity of each sole's lowest corner


def foot_motion(
    corners_ground: Sequence[Float[np.ndarray, "frames corners 3"]],
    root_ground: Float[np.ndarray, "frames 3"],
    times: Float[np.ndarray, " frames"],
    settings: GaitSettings,
) -> FootMotion:
    """Slip, surface and pace from the motion alone.

    The surface's velocity is the most common one of low soles near in time, so that belts may speed up; no
    height of the floor is asked for.

    Args:
        corners_ground: of each foot's sole [m].
        root_ground: a point of the pelvis [m].
        times: of the frames, equally spaced [s].
        settings: filter and thresholds.
    """
    rate = (len(times) - 1) / float(times[-1] - times[0])
    fine = np.arange(times[0], times[-1], 1 / STEPS_PER_S)
    soles = [_Sole(times, low_pass(c, rate, settings.cutoff_Hz)) for c in corners_ground]
    lowest = [by_frames(sole.lowest, fine) for sole in soles]
    surface = _surface(lowest, fine)
    slips = [by_frames(partial(sole.slip, low_m=LOW_M), fine, surface) for sole in soles]
    moving = CubicSpline(times, low_pass(root_ground, rate, settings.cutoff_Hz))(fine, 1)[:, [0, 2]] - surface
    window = max(1, round(PACE_WINDOW_S * STEPS_PER_S))
    pace = uniform_filter1d(np.linalg.norm(moving, axis=1), window, mode="nearest")
    sole = np.stack([own[:, 1:] for own in lowest], axis=1)
    return FootMotion(fine, np.column_stack(slips), surface, pace, sole)


class _Sole:
    """Corners of a sole between its frames, by a cubic spline; in a long trial by that of nearby frames."""

    def __init__(
        self, times: Float[np.ndarray, " frames"], corners_ground: Float[np.ndarray, "frames corners 3"]
    ) -> None:
        self.times, self.corners_ground = times, corners_ground
        self.whole = CubicSpline(times, corners_ground) if len(times) <= FRAMES_AT_ONCE else None

    def _near(self, times: Float[np.ndarray, " steps"]) -> CubicSpline:
        if self.whole is not None:
            return self.whole
        first, last = np.searchsorted(self.times, times[[0, -1]])
        near = slice(max(0, first - SPLINE_REACH_FRAMES), last + SPLINE_REACH_FRAMES)
        return CubicSpline(self.times[near], self.corners_ground[near])

    def lowest(self, times: Float[np.ndarray, " steps"]) -> Float[np.ndarray, "steps 3"]:
        """Height [m] of the lowest corner, and its velocity along x and z [m/s]."""
        spline = self._near(times)
        height, velocity = spline(times)[..., 1], spline(times, 1)
        own = velocity[np.arange(len(times)), height.argmin(axis=1)]
        return np.column_stack([height.min(axis=1), own[:, [0, 2]]])

    def slip(
        self, times: Float[np.ndarray, " steps"], surface: Float[np.ndarray, "steps 2"], low_m: float
    ) -> Float[np.ndarray, " steps"]:
        """Of the slowest of the low corners against the surface [m/s]."""
        spline = self._near(times)
        height, velocity = spline(times)[..., 1], spline(times, 1)
        low = height < height.min(axis=1, keepdims=True) + low_m
        against = np.insert(surface, 1, 0.0, axis=1)[:, None]
        return np.where(low, np.linalg.norm(velocity - against, axis=2), np.inf).min(axis=1)


def _surface(
    lowest: Sequence[Float[np.ndarray, "steps 3"]], times: Float[np.ndarray, " steps"]
) -> Float[np.ndarray, "steps 2"]:
    """Where velocities of low soles crowd, near in time; by mean shift from the densest sample."""
    pool, when = [], []
    for height, velocity in ((own[:, 0], own[:, 1:]) for own in lowest):
        low = np.flatnonzero(height <= np.quantile(height, SURFACE_LOW_SHARE))
        pool.append(velocity[low])
        when.append(times[low])
    samples, at = np.concatenate(pool), np.concatenate(when)
    thinned = slice(None, None, max(1, len(samples) // MOST_SAMPLES))
    samples, at = samples[thinned], at[thinned]
    near = _kernel(cdist(samples, samples) / SURFACE_SPREAD_M_S)
    grid = np.arange(times[0], times[-1] + GRID_S, GRID_S)
    found = np.zeros((len(grid), 2))
    for k, time in enumerate(grid):
        weight = _kernel((at - time) / SURFACE_WINDOW_S) + 1e-12
        centre = samples[int(np.argmax(near @ weight))]
        for _ in range(ROUNDS):
            own = weight * _kernel(np.linalg.norm(samples - centre, axis=1) / SURFACE_SPREAD_M_S)
            centre = own @ samples / own.sum()
        found[k] = centre
    if np.median(np.linalg.norm(found, axis=1)) < STILL_M_S:
        found[:] = 0.0
    return np.column_stack([np.interp(times, grid, found[:, axis]) for axis in range(2)])


def _kernel(distance: Float[np.ndarray, "*any"]) -> Float[np.ndarray, "*any"]:
    return np.exp(-(distance**2) / 2)
