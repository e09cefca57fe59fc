"""The division of a wrench among feet against a beam on two supports, and against what it must not change."""

from dataclasses import replace

import numpy as np
import pytest

from solver.contact.sole import soles
from solver.dynamics.force_prediction.divided_wrench import divide_wrench, press_on_soles
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import body_poses

FEET = ("calcn_r", "calcn_l")
BOTH = np.ones((1, 2), dtype=bool)


@pytest.fixture(scope="module")
def body():
    return default_skeleton()


@pytest.fixture(scope="module")
def standing(body):
    """Upright, feet beside each other."""
    q = np.zeros((1, len(body.dofs)))
    q[:, body.dofs.index("pelvis_ty")] = 1.0
    return q


@pytest.fixture(scope="module")
def centres(body, standing):
    """The middle of each sole [m]."""
    return [sole.corners_ground(*body_poses(body, standing))[0].mean(axis=0) for sole in soles(body, FEET)]


def pressing(point, force):
    """A force on a point, with its moment about the ground origin."""
    return np.concatenate([force, np.cross(point, force)])[None]


def test_a_foot_over_the_line_of_force_carries_all(body, standing, centres):
    force = np.array([30.0, 700.0, -10.0])
    for foot, centre in enumerate(centres):
        shares = divide_wrench(body, FEET, standing, pressing(centre, force), BOTH)[0]
        assert np.linalg.norm(shares[1 - foot, :3]) < 0.02 * np.linalg.norm(force)


@pytest.mark.parametrize("share", [0.3, 0.5, 0.8])
def test_between_the_soles_the_lever_rule_holds(body, standing, centres, share):
    """Supports at the soles' inner edges, level with their middles: moments about each give the loads."""
    right, left = (sole.corners_ground(*body_poses(body, standing))[0] for sole in soles(body, FEET))
    inner_right, inner_left = (_inner_edge(c, middle) for c, middle in ((right, left), (left, right)))
    point = share * inner_right + (1 - share) * inner_left
    shares = divide_wrench(body, FEET, standing, pressing(point, np.array([0.0, 700.0, 0.0])), BOTH)[0]
    np.testing.assert_allclose(shares[:, 1], [700 * share, 700 * (1 - share)], atol=9)  # 1 mm of 8 cm


def test_pressure_that_spares_the_rim_has_a_longer_lever(body, standing):
    """Supports half-way from a hind foot's inner corner to its middle: moments about each give the loads."""
    pieces = [sole.parts[0] for sole in soles(body, FEET)]
    place = body_poses(body, standing)[1][0]
    right, left = (piece.corners_body + place[piece.body] for piece in pieces)
    supports = [
        (own.mean(axis=0) + _inner_edge(own, other)) / 2 for own, other in ((right, left), (left, right))
    ]
    wrench = pressing(0.3 * supports[0] + 0.7 * supports[1], np.array([0.0, 700.0, 0.0]))
    forces = press_on_soles(body, FEET, standing, wrench, BOTH, reach=0.5)[0]
    np.testing.assert_allclose(forces[:, 1], [210, 490], atol=9)
    across = (supports[0][1] * forces[:, 2] - forces[:, 3]) / forces[:, 1]  # at the soles' height
    np.testing.assert_allclose(across, [support[2] for support in supports], atol=0.002)
    np.testing.assert_allclose(forces[:, :3].sum(axis=0), wrench[0, :3], atol=1e-9)
    near_edge = press_on_soles(body, FEET, standing, wrench, BOTH)[0, 0, 1]
    assert near_edge < 190  # the whole sole has the shorter lever: shares lie farther from a half


def _inner_edge(corners, others):
    """The corner of a sole's widest part that is nearest to the other sole."""
    away = np.sign(others[:, 2].mean() - corners[:, 2].mean())
    return corners[np.argmax(away * corners[:, 2])]


def test_the_parts_are_together_the_whole(body, standing):
    rng = np.random.default_rng(0)
    q = standing + 0.3 * rng.normal(size=(40, standing.shape[1]))
    whole = rng.normal(size=(40, 6)) * [200, 200, 200, 100, 100, 100] + [0, 600, 0, 0, 0, 0]
    parts = divide_wrench(body, FEET, q, whole, np.ones((40, 2), dtype=bool))
    np.testing.assert_allclose(parts.sum(axis=1), whole, atol=1e-9)


def test_a_foot_that_takes_no_part_gets_nothing_and_the_other_all(body, standing):
    whole = np.array([[30.0, 600.0, -20.0, 5.0, 40.0, 300.0]])
    parts = divide_wrench(body, FEET, standing, whole, np.array([[True, False]]))
    np.testing.assert_allclose(parts, np.stack([whole, 0 * whole], axis=1), atol=1e-9)


def test_nothing_is_divided_into_nothing(body, standing):
    assert not divide_wrench(body, FEET, standing, np.zeros((1, 6)), BOTH).any()


def test_feet_apart_lean_together_in_whatever_order_they_are_named(body, standing):
    apart = standing.copy()
    for side, angle in (("r", 0.4), ("l", -0.4)):
        apart[:, body.dofs.index(f"hip_flexion_{side}")] = angle
    poses = body_poses(body, apart)
    middle = np.mean([s.corners_ground(*poses)[0].mean(axis=0) for s in soles(body, FEET)], axis=0)
    ahead, behind = divide_wrench(body, FEET, apart, pressing(middle, np.array([0.0, 700.0, 0.0])), BOTH)[0]
    assert ahead[0] < -30  # [N] the foot in front pushes back, the one behind forwards
    assert behind[0] > 30
    mirrored = divide_wrench(body, FEET[::-1], apart, pressing(middle, np.array([0.0, 700.0, 0.0])), BOTH)[0]
    np.testing.assert_allclose(mirrored, [behind, ahead], atol=1e-9)


def test_a_heavier_body_divides_alike(body, standing, centres):
    heavier = replace(body, bodies=tuple(replace(b, mass=2 * b.mass) for b in body.bodies))
    wrench = pressing(0.4 * centres[0] + 0.6 * centres[1], np.array([20.0, 700.0, 5.0]))
    np.testing.assert_allclose(
        divide_wrench(body, FEET, standing, wrench, BOTH),
        divide_wrench(heavier, FEET, standing, wrench, BOTH),
        atol=1e-9,
    )
