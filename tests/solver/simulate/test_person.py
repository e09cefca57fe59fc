"""Synthetic people, and what one of another size does."""

import numpy as np
import pytest

from solver.simulate.person import Person, body_of
from solver.simulate.similar import similar_body, similar_trial
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import ForwardKinematics, body_poses, marker_positions
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.segment_tables import lengths


@pytest.fixture(scope="module")
def body():
    return body_of(Person(66.0, 1.71, "female"), np.random.default_rng(8))


def test_weighs_what_the_scale_says(body):
    assert body.skeleton.mass == pytest.approx(66.0, rel=1e-12)


def test_differs_from_the_tables_as_much_as_people_do(body):
    tables = default_skeleton(mass_kg=66.0, height_m=1.71, sex="female")
    ratios = np.array([b.mass / t.mass for b, t in zip(body.skeleton.bodies, tables.bodies, strict=True)])
    assert 0.01 < np.std(ratios) < 0.12
    thigh = [s.joints[s.body_index("tibia_r")].p_parent_frame[1] for s in (body.skeleton, tables)]
    assert 1e-4 < abs(thigh[0] / thigh[1] - 1) < 0.08


def test_is_alike_on_both_sides(body):
    by_name = {b.name: b for b in body.skeleton.bodies}
    for name, right in by_name.items():
        if name.endswith("_r"):
            left = by_name[name[:-1] + "l"]
            assert left.mass == pytest.approx(right.mass, rel=1e-12)
            np.testing.assert_allclose(left.com_body, right.com_body * (1, 1, -1), atol=1e-12)


def test_stands_on_the_soles(body):
    _, origins = body_poses(body.skeleton, body.skeleton.default_q[None])
    for name in ("calcn_r", "toes_l"):
        assert origins[0, body.skeleton.body_index(name), 1] == pytest.approx(body.sole.thickness, abs=1e-9)


def test_skin_moves_cluster_markers_more_than_bony_ones_and_none_in_the_default_pose(body):
    skeleton = body.skeleton
    np.testing.assert_allclose(
        body.markers(skeleton.default_q[None]),
        marker_positions(skeleton, skeleton.default_q[None]),
        atol=0.004,
    )
    q = skeleton.default_q.copy()
    q[[skeleton.dofs.index(f"{joint}_r") for joint in ("hip_flexion", "knee_angle", "ankle_angle")]] = 0.8
    moved = np.linalg.norm(body.markers(q[None]) - marker_positions(skeleton, q[None]), axis=2)[0]
    on_leg = np.array([skeleton.bodies[m.body].name in ("femur_r", "tibia_r") for m in skeleton.markers])
    fixed = np.array([m.fixed for m in skeleton.markers])
    assert 0.005 < moved[on_leg & ~fixed].mean() < 0.05
    assert moved[on_leg & fixed].mean() < 0.6 * moved[on_leg & ~fixed].mean()


def test_two_people_differ_and_one_stays_the_same():
    one, again, other = (body_of(Person(), np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert one.skeleton.bodies[0].mass == again.skeleton.bodies[0].mass
    np.testing.assert_array_equal(one.softness, again.softness)
    assert one.skeleton.bodies[0].mass != other.skeleton.bodies[0].mass


def test_is_as_tall_as_measured_whatever_the_segments(body):
    of = lengths(1.71, "female")
    tables = default_skeleton(mass_kg=66.0, height_m=1.71, sex="female")
    torso = body.skeleton.body_index("torso")
    _, origins = body_poses(body.skeleton, body.skeleton.default_q[None])
    stretch = body.skeleton.bodies[torso].scale[1] / tables.bodies[torso].scale[1]
    above_navel = of.stature - of.hip_height - of.navel_above_hips
    assert origins[0, torso, 1] + stretch * above_navel == pytest.approx(1.71, abs=2e-3)


def test_soft_tissue_moves_all_markers_of_a_segment_alike():
    person = Person(
        bony_softness_m_per_rad=0.0, cluster_softness_m_per_rad=0.0, segment_softness_m_per_rad=0.01
    )
    body = body_of(person, np.random.default_rng(2))
    skeleton = body.skeleton
    knee = skeleton.dofs.index("knee_angle_r")
    thigh = [m for m, marker in enumerate(skeleton.markers) if marker.body == skeleton.body_index("femur_r")]
    np.testing.assert_array_equal(
        body.softness[thigh, :, knee], body.softness[thigh[:1] * len(thigh), :, knee]
    )
    assert 0 < np.linalg.norm(body.softness[thigh[0], :, knee]) <= 0.01
    trunk = [m for m, marker in enumerate(skeleton.markers) if marker.body == skeleton.body_index("torso")]
    assert not body.softness[trunk][:, :, knee].any()


CHILD = 0.66, 21.0  # ratio of statures, mass [kg]


@pytest.fixture(scope="module")
def child(trial):
    return similar_trial(trial, similar_body(trial.body, *CHILD))


def test_newton_and_euler_hold_for_the_child(child):
    """By recursive Newton-Euler on the child's own model, which knows nothing of the first person."""
    skeleton = child.body.skeleton
    times = np.linspace(0.05, child.scenario.duration, 60)
    wrenches = child.reactions(times).wrench_ground
    feet = [skeleton.body_index(f"calcn_{side}") for side in "rl"]
    residual = RigidBodyModel(skeleton).inverse_dynamics(*child.motion.state(times), wrenches, feet)[:, :6]
    standing = ~child.contacts.flight(times)
    weight = CHILD[1] * 9.80665
    assert standing.any()
    assert np.abs(residual[standing]).max() < 1e-6 * weight
    assert (
        np.abs(residual[~standing]).max(initial=0.0) < 0.01 * weight
    )  # as the first person's between frames


def test_standing_feet_stay_where_they_are(child):
    """The heel's bone rests while the heel is planted, by forward kinematics."""
    seen = 0
    for stance in child.contacts.stances:
        start, end = np.clip(stance.heel_planted, 0.0, child.scenario.duration)
        if end - start < 0.1:
            continue
        times = np.linspace(start + 0.03, end - 0.03, 7)
        foot = child.body.skeleton.body_index(f"calcn_{'rl'[stance.foot]}")
        q = child.motion.derivative(times, 0)
        origin = _origins(child, q)[:, foot]
        assert np.ptp(origin, axis=0).max() < 0.01
        seen += 1
    assert seen or child.scenario.name == "run"  # whose heels are planted too briefly


def test_speed_and_forces_go_with_size(trial, child):
    ratio, mass = CHILD
    forces = [
        one.reactions(np.linspace(0.1, 0.9, 50) * one.scenario.duration).force_ground.sum(axis=1)
        / (one.body.skeleton.mass * 9.80665)
        for one in (trial, child)
    ]
    np.testing.assert_allclose(forces[1], forces[0], atol=1e-6)
    assert child.body.skeleton.mass == pytest.approx(mass)
    hips = [_origins(one, one.motion.derivative(np.array([0.4]), 0))[0, :, 1].max() for one in (trial, child)]
    assert hips[1] / hips[0] == pytest.approx(ratio, abs=0.02)


def _origins(trial, q):
    return ForwardKinematics(trial.body.skeleton).poses(q).p_ground_body
