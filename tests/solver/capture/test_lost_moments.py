"""A step whose centre of pressure the file lost while a wrong zero level made its force small."""

from dataclasses import replace

import numpy as np
import pytest

from solver.capture.capture import ForcePlate
from solver.capture.plates.centre_of_pressure import Surface
from solver.capture.plates.plate_levels import POINT_LOST_N, bridge_moments, moments_lost

RATE = 1000.0
FLOOR = Surface(np.zeros(3), np.array([0.0, 1.0, 0.0]))


@pytest.fixture
def step():
    """Half a second: the pressure rolls 20 cm forward at an even speed."""
    phase = np.linspace(0, 1, 500)
    force = np.stack([60 * np.sin(2 * np.pi * phase), 700 * np.sin(np.pi * phase), 0 * phase + 8], axis=1)
    point = np.stack([0.4 + 0.2 * phase, 0 * phase, 0.1 + 0.01 * phase], axis=1)
    moment = np.cross(point, force) + np.array([0.0, 3.0, 0.0])
    return ForcePlate("fp1", force, moment, point, RATE)


def test_points_between_the_neighbours_are_put_back(step):
    lost = np.abs(step.force_ground[:, 1] - 400.0) < POINT_LOST_N  # as read with a level of 400 N off
    broken = np.where(lost[:, None], 0.0, step.moment_ground)
    corrected = bridge_moments(replace(step, moment_ground=broken), lost, FLOOR)
    assert lost.sum() > 40
    np.testing.assert_allclose(corrected.moment_ground, step.moment_ground, atol=1e-6)


def test_unloaded_samples_and_whole_plates_are_left_alone(step):
    everywhere = np.ones(step.samples, dtype=bool)
    assert bridge_moments(step, everywhere, FLOOR) is step  # nothing to go by
    assert bridge_moments(step, ~everywhere, FLOOR) is step
    small = step.force_ground[:, 1] < 20.0
    assert bridge_moments(step, small, FLOOR) is step


def test_only_files_with_columns_for_the_point_lose_moments(step):
    assert not moments_lost(step).any()
    filed = replace(step, point_ground=step.cop_ground)
    np.testing.assert_array_equal(moments_lost(filed), np.abs(step.force_ground[:, 1]) < POINT_LOST_N)
