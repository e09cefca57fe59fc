"""Files in axes of a sloping belt: of the forces alone, or of the markers as well."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solver.diagnosis.causes.belts import OF_ALL, OF_FORCES, BeltSlope
from solver.diagnosis.causes.effect import Fitted


def heading(scene):
    """Where the walk goes."""
    way = (scene.com_ground[-1] - scene.com_ground[0]) * [1.0, 0.0, 1.0]
    return way / np.linalg.norm(way)


def in_axes_of_the_belt(slope_deg, capture, ahead):
    """Wrenches and pressures of a walk, read by plates that lie on the slope."""
    turn = Rotation.from_rotvec(-np.radians(slope_deg) * np.cross(ahead, [0.0, 1.0, 0.0]))
    return replace(
        capture,
        plates=tuple(
            replace(
                plate,
                force_ground=turn.apply(plate.force_ground),
                moment_ground=turn.apply(plate.moment_ground),
                cop_ground=turn.apply(plate.cop_ground),
                point_ground=None,
                corners_ground=turn.apply(plate.corners_ground),
            )
            for plate in capture.plates
        ),
    )


@pytest.mark.parametrize("slope_deg", [-12.0, 6.0, 15.0])
def test_the_true_wrench_comes_back_from_forces_of_the_belt(crisp, seen, slope_deg):
    true = seen(crisp)
    scene = seen(in_axes_of_the_belt(slope_deg, crisp, heading(true)))
    signature = BeltSlope(OF_FORCES).signature(scene, (np.radians(slope_deg),))
    missing = true.measured_ground - scene.measured_ground
    left = missing - signature.fixed
    columns = signature.columns.reshape(-1, 2)
    x = np.linalg.lstsq(columns, left.reshape(-1), rcond=None)[0]
    rest = left.reshape(-1) - columns @ x
    assert np.sqrt((rest**2).mean()) < 0.02 * np.sqrt((missing**2).mean())


@pytest.mark.parametrize("slope_deg", [-8.0, 14.0])
def test_gravity_leans_where_all_is_in_axes_of_the_belt(crisp, seen, slope_deg):
    """Body by body: what the same motion demands more in a field that leans."""
    scene, lean = seen(crisp), np.radians(slope_deg)
    upwards = np.sin(lean) * heading(scene) + np.array([0.0, np.cos(lean) - 1.0, 0.0])
    more = np.zeros((scene.frames, 6))
    for b, body in enumerate(scene.skeleton.bodies):
        centre = scene.p_ground_body[:, b] + scene.R_ground_body[:, b] @ body.com_body
        force = np.broadcast_to(9.80665 * body.mass * upwards, centre.shape)
        more += np.concatenate([force, np.cross(centre, force)], axis=1)
    fixed = BeltSlope(OF_ALL).signature(scene, (lean,)).fixed
    np.testing.assert_allclose(-fixed, more, atol=0.02 * np.abs(more).max())


def test_bounds_and_the_practical_minimum(crisp, seen):
    one = BeltSlope(OF_ALL)
    assert one.admissible((np.radians(8.0),))
    assert not one.admissible((np.radians(2.0),))  # a vertical out of level
    assert not one.admissible((np.radians(40.0),))
    assert all(one.admissible(eta) for eta in one.starts([seen(crisp)]))
    found = one.estimates([], Fitted((np.radians(-7.0),), (np.radians(0.2),), np.zeros(0), np.zeros((0, 0))))
    assert found["slope_deg"].value == pytest.approx(-7.0)
    assert one.is_notable(found)


def test_no_candidate_where_nothing_is_loaded(crisp, seen):
    scene = seen(crisp)
    assert {c.target for c in BeltSlope.candidates([scene])} == {OF_ALL, OF_FORCES}
    assert BeltSlope.candidates([replace(scene, plates=())]) == []
