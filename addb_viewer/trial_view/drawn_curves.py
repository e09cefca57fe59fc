"""What all kinds of recordings draw alike: sizes, and curves that follow from a trial's arrays."""

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
    known = np.isfinite(markers.errors)
    errors, count = np.where(known, markers.errors, 0.0), known.sum(axis=1)
    rms = np.sqrt((errors**2).sum(axis=1) / np.maximum(count, 1))
    return np.where(count > 0, rms, np.nan), np.where(count > 0, errors.max(axis=1, initial=0.0), np.nan)


def used_norm(
    vectors: Float[np.ndarray, "frames 3"], residual: ResidualReplay
) -> Float[np.ndarray, " frames"]:
    """Norms on the frames that the figures count; NaN on the others."""
    return np.where(residual.used, np.linalg.norm(vectors, axis=1), np.nan)


def nanoseconds(seconds: Float[np.ndarray, "*rows"]) -> Int[np.ndarray, "*rows"]:
    """Times to the nearest nanosecond."""
    return np.rint(np.asarray(seconds) * 1e9).astype(np.int64)
