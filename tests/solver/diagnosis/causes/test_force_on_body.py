import numpy as np

from solver.diagnosis.causes.on_segments import columns_at_point, prior_with_reach, trunk_bodies
from solver.diagnosis.causes.scene import force_at


def test_shifts_of_the_point_are_first_moments(scene):
    """Exact at any size: a force is linear in its arm."""
    body = scene.skeleton.body_index("femur_l")
    point, shift = np.array([0.02, -0.2, 0.01]), np.array([0.05, 0.03, -0.04])
    time_history = np.random.default_rng(1).standard_normal((scene.frames, 3))
    columns = columns_at_point(scene, body, point, time_history)
    given = columns @ np.array([7.0, *(7.0 * shift)])
    exact = force_at(7.0 * time_history, scene.point_ground(body, point + shift))
    assert np.abs(given - exact).max() < 1e-12 * np.abs(exact).max() + 1e-12


def test_prior_of_shifts_is_the_force_times_the_reach():
    assert prior_with_reach(50.0, 0.1).tolist() == [50.0, 5.0, 5.0, 5.0]


def test_trunk_is_the_root_and_the_heaviest_body_without_a_counterpart(scene):
    assert trunk_bodies(scene.skeleton) == ("pelvis", "torso")
