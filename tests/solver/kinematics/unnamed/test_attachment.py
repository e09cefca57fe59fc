import numpy as np
import pytest

from solver.kinematics.unnamed.landmark_mixture import landmark_mixture
from solver.kinematics.unnamed.whole_recording import Seen, Tolerance, attach


@pytest.fixture(scope="module")
def bending():
    """The default body bends its right knee and elbow."""
    mixture = landmark_mixture()
    q = np.tile(mixture.skeleton.default_q, (20, 1))
    for name in ("knee_angle_r", "elbow_flex_r"):
        q[:, mixture.skeleton.dofs.index(name)] = np.linspace(0, 1.2, 20)
    return mixture, q


def attached(mixture, q, points):
    landmarks = len(mixture.landmarks)
    before = np.full((points.shape[1], landmarks), 1 / landmarks)
    seen = Seen(points, np.ones((points.shape[1], landmarks), dtype=bool))
    return attach(seen, q, before, mixture, tolerance=Tolerance(0.015, 0.03), arms=True)


def test_a_marker_belongs_to_the_body_on_which_it_stays(bending):
    mixture, q = bending
    poses = mixture.kinematics.poses(q)
    on = {name: mixture.skeleton.body_index(name) for name in ("femur_r", "tibia_r")}
    at = {"femur_r": np.array([0.02, -0.35, 0.05]), "tibia_r": np.array([0.02, -0.12, 0.05])}
    points = np.stack(
        [(poses.R_ground_body[:, b] @ at[n]) + poses.p_ground_body[:, b] for n, b in on.items()], axis=1
    )
    found = attached(mixture, q, points)
    assert found.on_body(mixture).argmax(axis=1).tolist() == list(on.values())
    np.testing.assert_allclose(found.place_body[0, on["femur_r"]], at["femur_r"], atol=1e-9)


def test_a_marker_far_from_the_body_is_on_none(bending):
    mixture, q = bending
    points = np.full((len(q), 1, 3), 9.0)
    assert attached(mixture, q, points).share.sum() < 1e-6
