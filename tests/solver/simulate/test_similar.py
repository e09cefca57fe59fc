"""A person of another size who moves in similarity obeys F = ma like the first."""

import numpy as np
import pytest

from solver.simulate.similar import similar_body, similar_trial
from solver.skeleton.forward import ForwardKinematics
from solver.skeleton.pinocchio_model import RigidBodyModel

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
