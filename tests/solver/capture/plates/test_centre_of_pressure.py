"""Centre of pressure from a wrench, on level plates and on ramps."""

import numpy as np
import pytest

from solver.capture.capture import ForcePlate
from solver.capture.plates.centre_of_pressure import Surface, centre_of_pressure, surface_of

RNG = np.random.default_rng(3)


def pressed(normal, height=0.0, samples=200):
    """Feet at random points of a plane, with random forces and free moments about its normal."""
    normal = np.asarray(normal) / np.linalg.norm(normal)
    point = RNG.uniform(-1, 1, (samples, 3))
    point[:, 1] = height - (normal[0] * point[:, 0] + normal[2] * point[:, 2]) / normal[1]
    force = np.column_stack(
        [RNG.normal(0, 100, samples), RNG.uniform(50, 1500, samples), RNG.normal(0, 60, samples)]
    )
    moment = np.cross(point, force) + RNG.normal(0, 10, (samples, 1)) * normal
    return point, force, moment


@pytest.mark.parametrize("normal", [(0, 1, 0), (0.2, 1, 0), (-0.1, 1, 0.15)])
def test_finds_the_point_that_the_wrench_was_made_from(normal):
    point, force, moment = pressed(normal, height=0.12)
    surface = Surface(np.array([0, 0.12, 0.0]), np.asarray(normal) / np.linalg.norm(normal))
    np.testing.assert_allclose(centre_of_pressure(force, moment, surface), point, atol=1e-9)


def test_is_unknown_where_nothing_presses():
    force = np.array([[5.0, 0, 0], [0, -700, 0], [0, 700, 0]])
    cop = centre_of_pressure(force, np.zeros((3, 3)), Surface(np.zeros(3), np.array([0.0, 1, 0])))
    assert np.isnan(cop[:2]).all()
    np.testing.assert_array_equal(cop[2], 0)


def plate(cop, corners=None):
    blank = np.zeros_like(cop)
    return ForcePlate("1", blank, blank, cop, rate=1000, corners_ground=corners)


def test_height_from_the_files_own_centres_of_pressure():
    cop = pressed((0, 1, 0), height=-0.0075)[0]
    cop[::3] = np.nan
    surface = surface_of(plate(cop))
    assert surface.point_ground[1] == pytest.approx(-0.0075)
    np.testing.assert_array_equal(surface.normal_ground, [0, 1, 0])


def test_a_ramp_from_the_files_own_centres_of_pressure():
    normal = np.array([-0.17, 1, 0.05]) / np.linalg.norm([-0.17, 1, 0.05])
    np.testing.assert_allclose(surface_of(plate(pressed(normal)[0])).normal_ground, normal, atol=1e-9)


def test_noise_in_height_is_no_ramp():
    cop = pressed((0, 1, 0))[0]
    cop[:, 1] = RNG.normal(0, 0.02, len(cop))
    np.testing.assert_array_equal(surface_of(plate(cop)).normal_ground, [0, 1, 0])


def test_corners_decide():
    corners = np.array([[0, 0.2, 0], [0.6, 0.2, 0], [0.6, 0.2, 0.4], [0, 0.2, 0.4]])
    surface = surface_of(plate(pressed((0, 1, 0))[0], corners))
    np.testing.assert_allclose(surface.point_ground, [0.3, 0.2, 0.2])
    np.testing.assert_allclose(surface.normal_ground, [0, 1, 0])


def test_without_anything_the_surface_is_the_ground():
    surface = surface_of(plate(np.full((5, 3), np.nan)))
    np.testing.assert_array_equal(surface.point_ground, 0)


@pytest.mark.real
@pytest.mark.parametrize(
    "file", ["walk_rajagopal2015/grf.mot", "run_treadmill_hamner2013_subject04/run400/grf.mot"]
)
def test_recomputes_the_centres_of_pressure_of_real_files(real_data, file):
    from solver.capture.formats.storage import read_storage
    from solver.capture.plates.moment_convention import plates_from_storage

    for each in plates_from_storage(read_storage(real_data / file))[0]:
        loaded = each.force_ground[:, 1] > 50
        cop = centre_of_pressure(each.force_ground, each.moment_ground, surface_of(each))
        np.testing.assert_allclose(cop[loaded], each.cop_ground[loaded], atol=2e-4)
