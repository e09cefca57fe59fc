"""What all kinds of recordings draw alike: sizes, and curves that follow from a trial's arrays."""

import warnings

import numpy as np
from jaxtyping import Float, Int

from addb_viewer.trial_view.replay import MarkerReplay, ResidualReplay

METRES_PER_NEWTON = 1e-3  # as the app draws forces: standing on one leg reaches about the hip
SMALLEST_N = 20.0  # below it a plate's force is noise, and so is its centre of pressure
SMALLEST_RESIDUAL_N = 1.0  # a millimetre long


def marker_errors_of(
    markers: MarkerReplay,
) -> tuple[Float[np.ndarray, " frames"], Float[np.ndarray, " frames"]]:
    """RMS and largest error of each frame [m]; NaN where no marker has one."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # frames without any marker
        return np.sqrt(np.nanmean(markers.errors**2, axis=1)), np.nanmax(markers.errors, axis=1)


def used_norm(
    vectors: Float[np.ndarray, "frames 3"], residual: ResidualReplay
) -> Float[np.ndarray, " frames"]:
    """Norms on the frames that the figures count; NaN on the others."""
    return np.where(residual.used, np.linalg.norm(vectors, axis=1), np.nan)


def nanoseconds(seconds: Float[np.ndarray, "*rows"]) -> Int[np.ndarray, "*rows"]:
    """Times to the nearest nanosecond."""
    return np.rint(np.asarray(seconds) * 1e9).astype(np.int64)
