"""A harness, a band and a drag, and points that are known to a hand's breadth."""

import numpy as np
import pytest

from solver.diagnosis.causes.effect import Fitted
from solver.diagnosis.causes.forces_on_trunk import BodyWeightSupport, Drag, ElasticTether
from solver.simulate.loads import BodyPoint, PointForce, constant, drag, spring

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


ANCHOR = (-4.0, 1.1, 0.4)
STIFFNESS, REST = 20.0, 1.2


@pytest.fixture(scope="module")
def band(scene, walk):
    com = scene.skeleton.bodies[scene.skeleton.body_index("pelvis")].com_body
    point = BodyPoint(scene.skeleton, "pelvis", com)
    return PointForce(point, spring(np.array(ANCHOR), STIFFNESS, REST))(walk.motion, scene.times)


def test_is_exact_at_the_anchor_while_taut(scene, fitted, band):
    candidate = ElasticTether("pelvis")
    x, covariance = fitted(candidate, scene, band, ANCHOR)
    found = candidate.estimates([scene], Fitted(ANCHOR, (0.0, 0.0, 0.0), x, covariance))
    assert found["stiffness_N_per_m"].value == pytest.approx(STIFFNESS, rel=0.01)
    assert found["rest_length_m"].value == pytest.approx(REST, abs=0.02)
    assert found["mean_force_N"].value == pytest.approx(np.linalg.norm(band[:, :3], axis=1).mean(), rel=0.01)
    assert candidate.is_notable(found)


def test_an_anchor_elsewhere_fits_worse(scene, fitted, band):
    candidate = ElasticTether("pelvis")

    def left(anchor):
        x, _ = fitted(candidate, scene, band, anchor)
        return np.abs(band - candidate.signature(scene, anchor).columns @ x).max()

    right = left(ANCHOR)
    assert right < 0.05
    assert all(left(start) > right for start in candidate.starts([scene]))


def test_spread_of_the_rest_length_is_that_of_draws(scene):
    candidate = ElasticTether("pelvis")
    x, std = np.array([30.0, 100.0, 0, 0, 0]), np.array([1.0, 4.0, 1, 1, 1])
    draws = x + std * np.random.default_rng(0).standard_normal((20000, 5))
    found = candidate.estimates([scene], Fitted(ANCHOR, (0.0, 0.0, 0.0), x, np.diag(std**2)))["rest_length_m"]
    assert found.std == pytest.approx((draws[:, 0] / draws[:, 1]).std(), rel=0.03)


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
