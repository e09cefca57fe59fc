"""A walk over a plate as arrays, made by hand; no file is behind it."""

import numpy as np
import pytest

from addb_viewer import Plate, Recording

RATE = 100.0  # [Hz] of the cameras
PLATE_RATE = 1000.0  # [Hz]
NAMES = ("RHEE", "LHEE", "RTOE", "LTOE", "RASI", "LASI", "C7")


@pytest.fixture
def walk():
    """One second, y up: seven markers over a plate that carries 700 N."""
    t = np.arange(101) / RATE
    places = np.array(
        [
            [0.0, 0.05, 0.1],
            [0.0, 0.05, -0.1],
            [0.2, 0.02, 0.1],
            [0.2, 0.02, -0.1],
            [0.1, 1.0, 0.12],
            [0.1, 1.0, -0.12],
            [0.0, 1.45, 0.0],
        ]
    )
    markers = places + np.stack([1.3 * t, 0.01 * np.sin(6 * t), 0 * t], axis=1)[:, None]
    markers[10:20, 3] = np.nan
    s = np.arange(1001) / PLATE_RATE
    force = np.stack([20 * np.sin(6 * s), 700 + 50 * np.sin(12 * s), 5 * np.cos(6 * s)], axis=1)
    point = np.stack([0.1 + 0.2 * s, 0 * s, 0.02 + 0 * s], axis=1)
    free = np.stack([0 * s, 3 * np.sin(6 * s), 0 * s], axis=1)
    plate = Plate(force, s, centre_of_pressure=point, free_moment=free)
    return Recording(markers, NAMES, t, (plate,))
