"""The analytical baseline: what it errs by on noiseless motion is its differences and its split, no more."""

import numpy as np
import pytest

from addb_viewer.benchmark.predictors import Analytical, feet_on_ground, filtered
from addb_viewer.benchmark.scoring import completed, frame_errors
from addb_viewer.benchmark.task import central_differences
from solver.dynamics.root_wrench import centre_of_mass_of
from tests.addb_viewer.benchmark.simulated_release import GRAVITY, example


@pytest.fixture(scope="module")
def walk():
    return example()


def test_differences_of_a_parabola_are_exact():
    t = np.arange(20)[:, None] / 50.0
    velocity, acceleration = central_differences(3 * t**2 - 2 * t + 1, 50.0)
    np.testing.assert_allclose(acceleration, 6.0, rtol=1e-9)
    np.testing.assert_allclose(velocity[1:-1], (6 * t - 2)[1:-1], rtol=1e-9)


def test_what_is_left_on_noiseless_motion_is_truncation_and_split(walk):
    predicted = Analytical().predict(walk.seen)
    errors = frame_errors(walk.measured, completed(walk.seen, predicted), walk.seen.skeleton)
    q, dt = walk.seen.q, 1 / walk.seen.rate
    inner = slice(1, -1)
    velocity = (q[2:] - q[:-2]) / (2 * dt)
    acceleration = (q[2:] - 2 * q[1:-1] + q[:-2]) / dt**2

    def com(s):  # along the parabola that the differences stand for
        return centre_of_mass_of(walk.seen.skeleton, q[inner] + s * velocity + s**2 / 2 * acceleration)

    def second(h):
        return (com(h) - 2 * com(0.0) + com(-h)) / h**2

    by_parabola = (4 * second(1e-4) - second(2e-4)) / 3
    truncation = by_parabola - walk.measured.com_acceleration[inner]
    np.testing.assert_allclose(errors["com_acc"][inner], np.linalg.norm(truncation, axis=1), atol=1e-6)
    total = predicted.force.sum(axis=1)[inner] / walk.seen.mass_kg
    some = total.any(axis=1)
    np.testing.assert_allclose(total[some], (by_parabola - GRAVITY)[some], atol=1e-6)
    assert some.mean() > 0.9


def test_the_split_is_even_and_a_foot_in_the_air_has_none(walk):
    force = Analytical().predict(walk.seen).force
    on_ground = feet_on_ground(walk.seen, "height")
    both = on_ground.all(axis=1)
    assert both.any()
    np.testing.assert_array_equal(force[both, 0], force[both, 1])
    assert not force[~on_ground].any()


@pytest.mark.parametrize(("rule", "right"), [("height", 0.5), ("soles", 0.9)])
def test_contact_by_motion(walk, rule, right):
    loaded = walk.measured.force[..., 1] > 20
    assert (feet_on_ground(walk.seen, rule) == loaded).mean() > right


def test_names_say_filter_and_rule():
    assert filtered(6.0).name == "analytical-6Hz"
    assert filtered(contact="soles").name == "analytical-30Hz-soles"
