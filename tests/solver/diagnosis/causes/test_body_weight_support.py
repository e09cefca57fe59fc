import numpy as np
import pytest

from solver.diagnosis.causes.effect import Fitted
from solver.diagnosis.causes.forces_on_trunk import BodyWeightSupport
from solver.simulate.loads import BodyPoint, PointForce, constant

FORCE_N = 80.0


@pytest.fixture(params=["pelvis", "torso"])
def harness(request, scene, walk):
    body = scene.skeleton.body_index(request.param)
    offset = np.array([0.05, 0.1, -0.03])
    point = BodyPoint(scene.skeleton, request.param, scene.skeleton.bodies[body].com_body + offset)
    pull = PointForce(point, constant(np.array([0.0, FORCE_N, 0.0])))
    return request.param, offset, pull(walk.motion, scene.times)


def test_is_a_constant_force_upward_near_the_centre_of_mass(scene, explains, harness):
    body, offset, missing = harness
    x = FORCE_N * np.array([1.0, *offset])
    assert explains(BodyWeightSupport(body), scene, (), x, missing) < 1e-9


def test_force_is_recovered(scene, fitted, harness):
    body, _, missing = harness
    candidate = BodyWeightSupport(body)
    found = candidate.estimates([scene], Fitted((), (), *fitted(candidate, scene, missing)))
    assert found["force_N"].value == pytest.approx(FORCE_N, abs=0.2)
    assert candidate.is_notable(found)
    pressed = candidate.estimates([scene], Fitted((), (), *fitted(candidate, scene, -missing)))
    assert not candidate.is_notable(pressed)


def test_harnesses_hold_pelvis_and_trunk(scene):
    assert [c.target for c in BodyWeightSupport.candidates([scene])] == ["pelvis", "torso"]
