import numpy as np

from solver.diagnosis.causes.on_segments import required_by_bodies, required_by_changes
from solver.simulate.other_masses import with_segment_masses

LEG = ("femur_r", "tibia_r")


def test_bodies_demand_what_the_whole_does_beyond_the_rest(scene, demand_of):
    without = with_segment_masses(scene.skeleton, dict.fromkeys(LEG, 1e-9))
    expected = demand_of(scene.skeleton) - demand_of(without)
    given = required_by_bodies(scene, [scene.skeleton.body_index(name) for name in LEG])
    assert np.abs(given - expected).max() < 1e-5 * np.abs(expected).max()


def test_a_point_mass_demands_its_acceleration_against_gravity(scene):
    """Second differences of the point's place."""
    body, r = scene.skeleton.body_index("hand_l"), np.array([0.03, -0.1, 0.02])
    change = np.outer(np.append(r, 1.0), np.append(r, 1.0))[None]
    place = scene.point_ground(body, r)
    force = np.diff(place, 2, axis=0) * scene.rate**2 - scene.skeleton.gravity
    given = required_by_changes(scene, body, change)[1:-1, :, 0]
    assert np.sqrt(((given[:, :3] - force) ** 2).mean()) < 0.02 * np.sqrt((force**2).mean())
    moment = np.cross(place[1:-1], given[:, :3])
    assert np.abs(given[:, 3:] - moment).max() < 1e-9 * np.abs(moment).max() + 1e-9
