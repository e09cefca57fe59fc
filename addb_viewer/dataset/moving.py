"""A motion on the release's grid, and how far it takes the skeleton's markers from the measured ones."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from addb_viewer.dataset.grid import Grid
from solver.dynamics.trajectory.spline_basis import DEGREE, spline_at
from solver.fitting.fit import TrialFit
from solver.fitting.settings import Settings
from solver.kinematics.marker_errors import MarkerErrors
from solver.kinematics.motion import Motion
from solver.kinematics.resampled_motion import ResampledMotion, resampled

SAME_M = 1e-9  # [rad or m] that a spline may miss the fit's own frames by: rounding

ErrorsOf = Callable[[Motion], MarkerErrors]


@dataclass(frozen=True)
class Moving:
    """A pass of a trial."""

    motion: Motion
    errors: MarkerErrors


def moving_at(motion: Motion, grid: Grid, errors_of: ErrorsOf) -> Moving:
    """The natural quintic spline through a motion, at the grid's frames.

    Args:
        motion: at the recording's frames.
        grid: of the release.
        errors_of: markers' distances in a motion at the grid's frames.
    """
    at_frames = motion if grid.is_native else resampled(motion, grid.rate, grid.frames)
    return Moving(at_frames, errors_of(at_frames))


def spline_moving(trial: TrialFit, settings: Settings, grid: Grid, errors_of: ErrorsOf) -> Moving:
    """The fitted spline itself at the grid's frames; the one through the fit's frames where it is not kept.

    Args:
        trial: fitted to forces.
        settings: of the fit.
        grid: of the release.
        errors_of: as for `moving_at`.
    """
    coefficients = trial.spline
    if grid.is_native or coefficients is None or not trial.motion.posed.all():
        return moving_at(trial.motion, grid, errors_of)
    width = max(1, round(settings.trajectory.knot_spacing_s * grid.native_rate)) / grid.native_rate
    own = np.arange(grid.native_frames) / grid.native_rate
    if own[-1] > (len(coefficients) - DEGREE) * width + 1e-9:
        return moving_at(trial.motion, grid, errors_of)
    if np.abs(spline_at(coefficients, width, own) - trial.motion.q).max() > SAME_M:
        return moving_at(trial.motion, grid, errors_of)
    q, qd, qdd = (spline_at(coefficients, width, grid.seconds, order) for order in range(3))
    motion = ResampledMotion(trial.motion.dofs, q, grid.rate, grid.start_time, qd=qd, qdd=qdd)
    return Moving(motion, errors_of(motion))
