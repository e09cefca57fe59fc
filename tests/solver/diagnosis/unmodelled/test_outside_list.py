"""Unknown causes can be what they stand for: any fault of a plate, any wrench, any clock."""

from dataclasses import replace

import numpy as np
import pytest

from solver.diagnosis.causes.clocks import MOST_TRIALS
from solver.diagnosis.causes.plate_readings import required_of
from solver.diagnosis.unmodelled.open_world import (
    TIME_HISTORY_KNOTS_S,
    AnyClock,
    AnyPlateFault,
    AnyWrench,
    outside_the_list,
)
from tests.solver.diagnosis.causes.conftest import RATE


def best(columns, wanted):
    """What comes nearest in the span of the columns, frame by frame."""
    A = columns.reshape(-1, columns.shape[2])
    x = np.linalg.lstsq(A, wanted.reshape(-1), rcond=None)[0]
    return (A @ x).reshape(wanted.shape)


def about(wrench, point):
    """The same with its moment about a point, written with a loop over frames."""
    return np.array([[*w[:3], *(w[3:] - np.cross(point, w[:3]))] for w in wrench])


def test_a_plate_fault_may_be_any_map_of_its_load_and_any_zero(short_scene):
    """A plate turned by a quarter about its middle, of half gain, tared with a load on it."""
    plate = short_scene.plates[0]
    load = about(required_of(plate, short_scene), plate.centre_ground)
    R = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
    wrong = 0.5 * np.concatenate([load[:, :3] @ R.T, load[:, 3:] @ R.T], axis=1)
    wrong[plate.loaded] -= (10.0, 300.0, -5.0, 4.0, 0.0, 8.0)
    fault_ground = about(np.where(plate.loaded[:, None], load - wrong, 0.0), -plate.centre_ground)
    signature = AnyPlateFault("plate_1").signature(short_scene, (0.05,))
    assert signature.columns.shape[2] == 42
    np.testing.assert_allclose(best(signature.columns, fault_ground), fault_ground, atol=1e-6)
    assert not signature.columns[~plate.loaded].any()
    assert AnyPlateFault("plate_9").signature(short_scene, (0.05,)) is None


def test_any_wrench_may_be_any_steady_or_slow_one(short_scene):
    steady = np.broadcast_to((30.0, -100.0, 12.0, 5.0, -3.0, 9.0), (short_scene.frames, 6))
    ground = steady.copy()
    ground[:, 3:] += np.cross(short_scene.com_ground, steady[:, :3])
    own = AnyWrench("", "walk").signature(short_scene, (0.2,)).columns
    np.testing.assert_allclose(best(own, ground), ground, atol=1e-6)
    swing = ground * np.sin(2 * np.pi * 0.5 * short_scene.times)[:, None]
    swing[:, 3:] = np.cross(short_scene.com_ground, swing[:, :3])
    slow = AnyWrench("", "walk", TIME_HISTORY_KNOTS_S).signature(short_scene, (0.2,)).columns
    assert np.abs(best(slow, swing) - swing).max() < 2.0
    assert np.abs(best(own, swing) - swing).max() > 20.0


def test_a_clock_is_how_fast_the_recorded_wrench_changes(short_scene):
    late = AnyClock("walk", "walk").signature(short_scene, (0.05,))
    shifted = short_scene.retimed(lambda times: times + 0.001) - short_scene.measured_ground
    inner = slice(5, -5)
    of_1_ms = 0.001 * late.columns[inner, :, 0]
    assert np.abs(of_1_ms - shifted[inner]).max() < 0.15 * np.abs(shifted[inner]).max()
    assert late.prior_std == pytest.approx([0.005])


def test_the_family_is_small_and_each_touches_something(short_scene):
    family = outside_the_list([short_scene])
    assert 5 <= len(family) <= 12
    assert {one.kind for one in family} >= {"body", "plate"}  # clocks have names
    for one in family:
        signature = one.signature(short_scene, (0.05,))
        assert signature.columns.any()
        assert len(signature.prior_std) == signature.columns.shape[2]
    assert short_scene.rate == RATE


def test_clocks_that_no_entry_parts_are_of_unknown_time(short_scene):
    """A plate in one of several trials; a trial among more than have clocks of their own."""

    def times(count):
        scenes = [replace(short_scene, name=f"trial {k}") for k in range(count)]
        return [one.target for one in outside_the_list(scenes) if one.kind == "time"]

    assert times(1) == []
    assert all(" in trial " in target for target in times(2))
    assert len(times(2)) >= 4
    assert "trial 0" in times(MOST_TRIALS + 1)
