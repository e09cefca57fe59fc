"""A person who stands on two plates of their own clocks, as files that others might have written."""

from pathlib import Path

import numpy as np
import pytest

from solver.capture.capture import FootEvent, ForcePlate, Markers
from solver.export.c3d_file import C3dRecording, write_c3d
from tests.solver.export.conftest import contacts, fit, recorded_walk

__all__ = ["contacts", "fit", "recorded_walk"]

RATE, FRAMES = 100.0, 80
NAMES = ("RHEE", "LHEE", "RKNE", "RASI", "LASI", "HEAD")


def plate_at(name, rate, x, start_time=0.0) -> ForcePlate:
    """350 N that sway about a point of the floor; raw, with a zero level and no threshold."""
    t = start_time + np.arange(round(FRAMES / RATE * rate)) / rate
    force = np.column_stack([9 * np.sin(9 * t), 350 + 60 * np.cos(7 * t), 8 * np.cos(4 * t)])
    point = np.column_stack([x + 0.05 * np.sin(3 * t), 0 * t, 0.02 * np.cos(5 * t)])
    free = np.column_stack([0 * t, 2 * np.sin(5 * t), 0 * t])
    corners = np.array([[x + 0.3, 0, 0.2], [x - 0.3, 0, 0.2], [x - 0.3, 0, -0.2], [x + 0.3, 0, -0.2]])
    return ForcePlate(name, force, np.cross(point, force) + free, point, rate, start_time, corners)


@pytest.fixture
def recording() -> C3dRecording:
    t = np.arange(FRAMES) / RATE
    places = np.array(
        [[0, 0.05, -0.1], [0, 0.05, 0.1], [0, 0.5, -0.1], [0.1, 1, -0.1], [0.1, 1, 0.1], [0, 1.7, 0]]
    )
    positions = places + 0.02 * np.sin(7 * t)[:, None, None] * [1.0, 0.2, 0.5]
    positions[30:33, 2] = np.nan
    positions[50, 5] += 0.4  # a spike that cleaning would take out
    return C3dRecording(
        markers=Markers(NAMES, positions, RATE),
        plates=(plate_at("plate 1", 1000.0, -0.4), plate_at("plate 2", 1000.0, 0.4)),
        events=(FootEvent(0.125, "Right", "Foot Strike"), FootEvent(0.5, "Left", "Foot Off")),
        subject="P 01",
        mass_kg=71.0,
        height_m=1.75,
    )


@pytest.fixture
def c3d_file(recording, tmp_path) -> Path:
    write_c3d(tmp_path / "walk.c3d", recording)
    return tmp_path / "walk.c3d"
