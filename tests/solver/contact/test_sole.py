from dataclasses import replace

import numpy as np
import pytest

from solver.common.errors import ModelError
from solver.contact.sole import HEIGHT_SLACK_M, independent_feet, soles


def test_the_sole_reaches_from_heel_to_toes_below_the_ankle(standing):
    R, p = standing.poses()
    for side, sole in enumerate(soles(standing.skeleton, ("calcn_r", "calcn_l"))):
        corners = sole.corners_ground(R, p)[0] - standing.ankles[0, side]
        assert corners[:, 0].min() == pytest.approx(-0.25 * 0.13 / 0.46)
        assert corners[:, 0].max() == pytest.approx(0.75 * 0.13 / 0.46)
        np.testing.assert_allclose(corners[:, 1], -0.30 * 0.13 / 0.46)
        assert 0.09 < np.ptp(corners[:, 2]) < 0.12
        np.testing.assert_allclose(corners[:, 2].min(), -corners[:, 2].max())


@pytest.mark.parametrize(
    ("point", "expected"),
    [
        ((0.0, 0.0, 0.1), 0.0),  # under the ankle
        ((0.20, 0.0, 0.1), 0.0),  # under the toes, which are a body of their own
        ((0.0, 0.03, 0.1), 0.0),  # inside the foot; soles are no thicker known than that
        ((0.0, 0.10, 0.1), 0.06),  # above it
        ((0.312, 0.0, 0.1), 0.10),  # ahead of the toes
        ((-0.071, 0.0, 0.1), 0.0),  # at the heel's edge
        ((-0.101, 0.08, 0.1), 0.05),  # behind and above: 3-4-5
    ],
)
def test_distance_from_a_sole(standing, point, expected):
    R, p = standing.poses()
    p[..., 1] += 0.30 * 0.13 / 0.46 - 0.085  # the sole exactly on the ground
    sole = soles(standing.skeleton, ("calcn_r",))[0]
    found = sole.distance(R, p, np.tile(point, (len(p), 1)))
    np.testing.assert_allclose(found, expected, atol=1e-3)


def test_distance_is_that_from_the_nearest_of_many_points(standing):
    """Against a dense cover of both outlines with points."""
    R, p = standing.poses()
    sole = soles(standing.skeleton, ("calcn_r",))[0]
    rng = np.random.default_rng(0)
    cover = []
    for part in sole.parts:
        weights = rng.dirichlet(np.full(len(part.corners_body), 0.3), size=20000)
        cover.append(weights @ part.corners_body + p[0, part.body])
    points = rng.uniform([-0.3, -0.1, -0.2], [0.4, 0.2, 0.4], size=(len(p), 3))
    expected = []
    for point in points:
        offset = np.concatenate(cover) - point
        offset[:, 1] = np.maximum(0.0, np.abs(offset[:, 1]) - HEIGHT_SLACK_M)
        expected.append(np.linalg.norm(offset, axis=1).min())
    np.testing.assert_allclose(sole.distance(R, p, points), expected, atol=4e-3)


def test_toes_named_as_feet_belong_to_their_foot(standing):
    assert independent_feet(standing.skeleton, ("toes_r", "calcn_r", "calcn_l")) == ("calcn_r", "calcn_l")


@pytest.mark.parametrize(("named", "message"), [(("foot_r",), "no body foot_r"), ((), "no foot bodies")])
def test_feet_that_are_not_in_the_model_are_named(feet, named, message):
    with pytest.raises(ModelError, match=f"{message}.*bodies: shank_r, calcn_r"):
        independent_feet(feet, named)


def test_a_foot_in_one_piece_points_to_its_centre_of_mass(feet):
    stump = replace(feet, bodies=feet.bodies[:2], joints=feet.joints[:2], coordinates=feet.coordinates[:1])
    (part,) = soles(stump, ("calcn_r",))[0].parts
    length = 0.05 / (0.44 - 0.25)  # the mass centre lies 5 cm ahead of the ankle
    assert np.ptp(part.corners_body[:, 0]) == pytest.approx(length)


def test_a_body_without_direction_is_no_foot(feet):
    ball = replace(feet.bodies[1], com_body=np.array([0.0, -0.03, 0.0]))
    stump = replace(
        feet, bodies=(feet.bodies[0], ball), joints=feet.joints[:2], coordinates=feet.coordinates[:1]
    )
    with pytest.raises(ModelError, match="'calcn_r' is no foot"):
        soles(stump, ("calcn_r",))
