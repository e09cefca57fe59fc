"""A plate that lies beside its place or is turned; force vectors that lean."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solver.diagnosis.causes.effect import Fitted
from solver.diagnosis.causes.plate_geometry import GravityTilt, PlatePosition, PlateYaw


@pytest.mark.parametrize("shift", [(0.012, -0.005), (-0.1, 0.2)])
def test_the_true_wrench_comes_back_whatever_the_size(crisp, seen, refiled, shift):
    def moved(force, point, free):
        return force, point + np.array([shift[0], 0.0, shift[1]]), free

    plates = list(crisp.plates)
    plates[2] = refiled(plates[2], moved)
    scene = seen(replace(crisp, plates=tuple(plates)))
    signature = PlatePosition("plate_3").signature(scene, ())
    given = scene.measured_ground + signature.columns @ np.array(shift)
    np.testing.assert_allclose(given, seen(crisp).measured_ground, atol=1e-9)


def test_every_loaded_plate_is_a_candidate(crisp, seen):
    scene = seen(crisp)
    made = PlatePosition.candidates([scene, scene])
    assert [c.target for c in made] == [p.target for p in scene.plates for _ in range(2)]
    near, far = made[:2]
    assert far.prior_std_m > 5 * near.prior_std_m
    assert far.place_odds > near.place_odds == 0.0
    assert made[0].signature(replace(scene, plates=scene.plates[1:]), ()) is None


K = 1


def turned_by(yaw_deg, capture, seen, refiled):
    """The plate's force and centre of pressure turned about its centre, right hand about +y."""
    plate = capture.plates[K]
    centre = plate.corners_ground.mean(axis=0)
    R = Rotation.from_rotvec([0.0, np.radians(yaw_deg), 0.0])

    def turned(force, point, free):
        return R.apply(force), np.where(force[:, [1]] > 0, R.apply(point - centre) + centre, point), free

    plates = list(capture.plates)
    plates[K] = refiled(plate, turned)
    return seen(replace(capture, plates=tuple(plates)))


def left_over(yaw_deg, crisp, seen, refiled):
    scene = turned_by(yaw_deg, crisp, seen, refiled)
    x = np.array([np.sin(np.radians(yaw_deg))])
    given = PlateYaw("plate_2").signature(scene, ()).columns @ x
    missing = seen(crisp).measured_ground - scene.measured_ground
    return np.sqrt(((missing - given) ** 2).mean()) / np.sqrt((missing**2).mean())


def test_the_true_wrench_comes_back_to_second_order(crisp, seen, refiled):
    at_6, at_3 = (left_over(yaw, crisp, seen, refiled) for yaw in (6.0, 3.0))
    assert at_3 < 0.03
    assert at_3 == pytest.approx(at_6 / 2, rel=0.02)


def test_the_column_is_the_derivative(crisp, seen, refiled):
    step = 0.01
    more, less = (turned_by(sign * step, crisp, seen, refiled).measured_ground for sign in (1, -1))
    slope = (more - less) / np.radians(2 * step)
    column = PlateYaw("plate_2").signature(seen(crisp), ()).columns[:, :, 0]
    np.testing.assert_allclose(-column, slope, atol=1e-5 * np.abs(slope).max())


def test_estimates_are_degrees_of_the_same_sign():
    candidate = PlateYaw("plate_1")
    std = 0.01
    found = candidate.estimates(
        [], Fitted((), (), np.array([np.sin(np.radians(-3.0))]), np.array([[std**2]]))
    )
    assert found["yaw_deg"].value == pytest.approx(-3.0)
    assert found["yaw_deg"].std == pytest.approx(np.degrees(std) / np.cos(np.radians(3.0)))
    assert candidate.is_notable(found)
    assert not candidate.is_notable(
        candidate.estimates([], Fitted((), (), np.array([0.01]), np.array([[1e-4]])))
    )


def leaning(tilt_deg, capture, seen, refiled):
    R = Rotation.from_rotvec(np.radians([tilt_deg[0], 0.0, tilt_deg[1]]))

    def tilted(force, point, free):
        return R.apply(force), point, free

    return seen(replace(capture, plates=tuple(refiled(plate, tilted) for plate in capture.plates)))


def left_over_tilt(tilt_deg, crisp, seen, refiled):
    scene = leaning(tilt_deg, crisp, seen, refiled)
    given = GravityTilt("all").signature(scene, ()).columns @ np.radians(tilt_deg)
    missing = seen(crisp).measured_ground - scene.measured_ground
    return np.sqrt(((missing - given) ** 2).mean()) / np.sqrt((missing**2).mean())


def test_the_true_wrench_comes_back_to_second_order_where_it_leans(crisp, seen, refiled):
    tilt = np.array([1.2, -0.9])
    whole, half = (left_over_tilt(share * tilt, crisp, seen, refiled) for share in (1.0, 0.5))
    assert whole < 0.02
    assert half == pytest.approx(whole / 2, rel=0.02)


@pytest.mark.parametrize("axis", [0, 1])
def test_columns_are_derivatives(crisp, seen, refiled, axis):
    step = 0.01 * np.eye(2)[axis]
    more, less = (leaning(sign * step, crisp, seen, refiled).measured_ground for sign in (1, -1))
    slope = (more - less) / np.radians(0.02)
    column = GravityTilt("all").signature(seen(crisp), ()).columns[:, :, axis]
    np.testing.assert_allclose(-column, slope, atol=1e-5 * np.abs(slope).max())


def test_estimates_and_the_practical_minimum_where_it_leans():
    candidate = GravityTilt("all")
    covariance = np.diag(np.radians([0.1, 0.2]) ** 2)
    found = candidate.estimates([], Fitted((), (), np.radians([1.5, -0.5]), covariance))
    assert list(found) == ["tilt_x_deg", "tilt_z_deg"]
    assert [e.value for e in found.values()] == pytest.approx([1.5, -0.5])
    assert [e.std for e in found.values()] == pytest.approx([0.1, 0.2])
    assert candidate.is_notable(found)
    assert not candidate.is_notable(
        candidate.estimates([], Fitted((), (), np.radians([0.3, 0.3]), covariance))
    )
