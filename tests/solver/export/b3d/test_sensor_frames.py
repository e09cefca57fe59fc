"""What was measured, as a file holds it."""

import numpy as np
import pytest

from solver.capture.capture import Capture, ForcePlate, Markers
from solver.capture.plates.force_settings import CONDITIONING
from solver.export.b3d.sensor_frames import corners, marker_names, sensor_frames

RATE, TIMES = 100.0, np.arange(10) / 100


def plate(force, cop, *, name="1", rate=RATE, start=0.0, corners_ground=None):
    """A plate whose free moment is 2 N·m about y."""
    moment = np.cross(np.nan_to_num(cop), force) + np.array([0.0, 2.0, 0.0])
    return ForcePlate(name, force, moment, cop, rate, start, corners_ground)


def capture(*plates, markers=None):
    positions = np.arange(60.0).reshape(10, 2, 3)
    positions[4, 1] = np.nan
    return Capture("walk", markers or Markers(("C7", "T10"), positions, RATE), plates)


@pytest.fixture
def standing():
    force = np.column_stack([5 * np.sin(20 * TIMES), 700 + 0 * TIMES, 0 * TIMES])
    return plate(force, np.tile([0.3, 0.02, -0.1], (10, 1)))


def test_markers_in_the_order_of_the_subject():
    found = sensor_frames(capture(), ("T10", "LASI", "C7"), plates=0, settings=CONDITIONING)
    observed = found.marker_obs.reshape(10, 3, 3)
    np.testing.assert_array_equal(observed[:, 2], capture().markers.positions_ground[:, 0])
    assert np.isnan(observed[:, 1]).all()
    assert np.isnan(observed[:, 0]).any(axis=1).tolist() == [t == 4 for t in range(10)]
    assert found.raw_force_plate_force.shape == (10, 0)


def test_the_moment_is_about_the_point(standing):
    found = sensor_frames(capture(standing), ("C7", "T10"), plates=1, settings=CONDITIONING)
    np.testing.assert_allclose(found.raw_force_plate_force, standing.force_ground, atol=1e-9)
    np.testing.assert_allclose(found.raw_force_plate_cop, standing.cop_ground, atol=1e-9)
    np.testing.assert_allclose(found.raw_force_plate_torque, [[0, 2, 0]] * 10, atol=1e-9)


def test_without_a_point_the_moment_is_about_the_origin():
    force = np.tile([0.5, 1.5, 0.0], (10, 1))
    idle = plate(force, np.full((10, 3), np.nan))
    found = sensor_frames(capture(idle), ("C7", "T10"), plates=1, settings=CONDITIONING)
    np.testing.assert_array_equal(found.raw_force_plate_cop, 0.0)
    np.testing.assert_allclose(found.raw_force_plate_torque, idle.moment_ground, atol=1e-9)


def test_missing_plates_are_zero(standing):
    found = sensor_frames(capture(standing), ("C7", "T10"), plates=2, settings=CONDITIONING)
    assert found.raw_force_plate_force.shape == (10, 6)
    np.testing.assert_array_equal(found.raw_force_plate_force[:, 3:], 0.0)
    np.testing.assert_array_equal(found.raw_force_plate_cop[:, 3:], 0.0)


def test_a_faster_plate_that_starts_late():
    times = 0.03 + np.arange(200) / 1000
    force = np.column_stack([0 * times, 500 + 100 * times, 0 * times])
    late = plate(force, np.tile([0.1, 0.0, 0.2], (200, 1)), rate=1000.0, start=0.03)
    found = sensor_frames(capture(late), ("C7", "T10"), plates=1, settings=CONDITIONING)
    assert np.isnan(found.raw_force_plate_force[:3]).all()
    np.testing.assert_allclose(found.raw_force_plate_force[4:, 1], (500 + 100 * TIMES)[4:], rtol=1e-3)


def test_corners_known_and_unknown(standing):
    square = np.arange(12.0).reshape(4, 3)
    known = plate(standing.force_ground, standing.cop_ground, corners_ground=square)
    found = corners(capture(known, standing))
    np.testing.assert_array_equal(found[:12], square.reshape(-1))
    assert np.isnan(found[12:]).all()
    assert len(found) == 24


def test_names_of_all_trials():
    other = Markers(("T10", "LASI"), np.zeros((10, 2, 3)), RATE)
    assert marker_names([capture(), capture(markers=other)]) == ("C7", "T10", "LASI")
