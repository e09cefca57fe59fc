import numpy as np
import pytest

from solver.diagnosis.causes.effect import Fitted
from solver.diagnosis.causes.forces_on_trunk import ElasticTether
from solver.simulate.loads import BodyPoint, PointForce, spring

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


def test_belts_hold_pelvis_and_trunk(scene):
    assert [c.target for c in ElasticTether.candidates([scene])] == ["pelvis", "torso"]
