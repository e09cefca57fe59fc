"""A plate whose axes are turned."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solver.diagnosis.causes.effect import Fitted
from solver.diagnosis.causes.plate_geometry import PlateYaw

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


def test_every_loaded_plate_is_a_candidate(crisp, seen):
    scene = seen(crisp)
    made = PlateYaw.candidates([scene])
    assert [c.target for c in made] == [p.target for p in scene.plates]
    assert made[0].signature(replace(scene, plates=scene.plates[1:]), ()) is None
