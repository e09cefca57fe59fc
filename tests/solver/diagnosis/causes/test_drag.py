import numpy as np
import pytest

from solver.diagnosis.causes.effect import Fitted
from solver.diagnosis.causes.forces_on_trunk import Drag
from solver.simulate.loads import BodyPoint, PointForce, drag


@pytest.fixture(params=[1.0, 2.0], ids=["viscous", "quadratic"])
def wind(request, scene, walk):
    com = scene.skeleton.bodies[scene.skeleton.body_index("torso")].com_body
    law = PointForce(BodyPoint(scene.skeleton, "torso", com), drag(15.0, request.param))
    return request.param, law(walk.motion, scene.times)


def test_is_the_law_with_velocities_between_frames(scene, explains, wind):
    exponent, missing = wind
    assert explains(Drag("torso"), scene, (exponent,), [15.0, 0, 0, 0], missing) < 2e-3


def test_coefficient_and_mean_are_recovered(scene, fitted, wind):
    exponent, missing = wind
    candidate = Drag("torso")
    x, covariance = fitted(candidate, scene, missing, (exponent,))
    found = candidate.estimates([scene], Fitted((exponent,), (0.1,), x, covariance))
    assert found["b_Ns_per_m"].value == pytest.approx(15.0, rel=0.01)
    assert found["mean_force_N"].value == pytest.approx(
        np.linalg.norm(missing[:, :3], axis=1).mean(), rel=0.01
    )
    assert found["exponent"].value == exponent
    assert candidate.is_notable(found)


def test_what_pushes_forward_is_no_drag(scene, fitted, wind):
    exponent, missing = wind
    candidate = Drag("torso")
    found = candidate.estimates(
        [scene], Fitted((exponent,), (0.1,), *fitted(candidate, scene, -missing, (exponent,)))
    )
    assert not candidate.is_notable(found)


def test_at_pelvis_and_trunk(scene):
    assert [c.target for c in Drag.candidates([scene])] == ["pelvis", "torso"]
