"""Predicted wrenches against F = ma itself: put in as measured ones, they leave nothing to explain."""

from dataclasses import replace

import numpy as np
import pytest

from solver.contact.wrenches import FrameMask
from solver.dynamics.force_prediction.missing_wrench import with_joint_torques, wrenches_by_motion
from solver.dynamics.inverse_dynamics import inverse_dynamics
from solver.dynamics.settings import DynamicsSettings
from solver.kinematics.motion import Motion
from solver.kinematics.root_joint import root_joint
from solver.skeleton.default_body import default_skeleton
from tests.contacts import contacts_of

FRAMES, RATE = 120, 100.0
FEET = ("calcn_r", "calcn_l")
SETTINGS = DynamicsSettings()
WHOLE = np.ones((FRAMES, 2), dtype=bool)
GAP = slice(50, 80)


@pytest.fixture(scope="module")
def body():
    return default_skeleton()


@pytest.fixture(scope="module")
def motion(body):
    """Swaying on both feet, every angle on its own slow wave."""
    rng = np.random.default_rng(2)
    t = np.arange(FRAMES)[:, None] / RATE
    q = 0.05 * np.sin(rng.uniform(2, 6, len(body.dofs)) * t + rng.uniform(0, 6, len(body.dofs)))
    q[:, body.dofs.index("pelvis_ty")] += 1.0
    return Motion(body.dofs, q, RATE)


@pytest.fixture(scope="module")
def measured(body, motion):
    """Plates that tell the truth: the demand, all of it divided in a way that the rule does not know."""
    nothing = contacts_of(FEET, np.zeros((FRAMES, 2, 6)))
    none = FrameMask(~WHOLE)
    demand = wrenches_by_motion(
        body, inverse_dynamics(body, motion, nothing, none, SETTINGS), nothing, none
    ).sum(axis=1)
    right = (0.5 + 0.2 * np.sin(np.arange(FRAMES) / 15.0))[:, None]
    return contacts_of(FEET, np.stack([right * demand, (1 - right) * demand], axis=1))


def root_forces(body, motion, wrenches):
    return inverse_dynamics(
        body, motion, contacts_of(FEET, wrenches), FrameMask(WHOLE), SETTINGS
    ).residual_root


@pytest.mark.parametrize("feet", [[0], [1], [0, 1]], ids=["right", "left", "both"])
def test_with_predicted_wrenches_nothing_is_left_to_explain(body, motion, measured, feet):
    counts = WHOLE.copy()
    counts[GAP, feet] = False
    mask = FrameMask(counts)
    dynamics = inverse_dynamics(body, motion, measured, mask, SETTINGS)
    wrenches = wrenches_by_motion(body, dynamics, measured, mask)
    assert np.abs(dynamics.residual_root[GAP]).max() > 100
    np.testing.assert_allclose(root_forces(body, motion, wrenches), 0, atol=1e-6)
    np.testing.assert_array_equal(wrenches[counts], measured.wrench_ground[counts])


def test_one_missing_foot_gets_just_what_its_plate_would_have_read(body, motion, measured):
    counts = WHOLE.copy()
    counts[GAP, 1] = False
    mask = FrameMask(counts)
    dynamics = inverse_dynamics(body, motion, measured, mask, SETTINGS)
    np.testing.assert_allclose(
        wrenches_by_motion(body, dynamics, measured, mask), measured.wrench_ground, atol=1e-6
    )


def test_at_the_border_the_division_goes_on_as_the_plates_had_it(body, motion, measured):
    counts = WHOLE.copy()
    counts[GAP] = False
    mask = FrameMask(counts)
    dynamics = inverse_dynamics(body, motion, measured, mask, SETTINGS)
    wrenches = wrenches_by_motion(body, dynamics, measured, mask)
    rule = wrenches_by_motion(body, replace(dynamics, used=np.zeros(FRAMES, dtype=bool)), measured, mask)
    for border, inside in ((GAP.start - 1, GAP.start), (GAP.stop, GAP.stop - 1)):
        difference = np.abs(measured.wrench_ground[border, :, 1] - rule[inside, :, 1]).max()
        step = np.abs(wrenches[border, :, 1] - wrenches[inside, :, 1]).max()
        assert difference > 50  # [N]
        assert step < 0.2 * difference


def test_far_from_any_measured_frame_the_rule_alone_holds(body, motion, measured):
    counts = WHOLE.copy()
    counts[20:100] = False
    mask = FrameMask(counts)
    dynamics = inverse_dynamics(body, motion, measured, mask, SETTINGS)
    alone = wrenches_by_motion(body, replace(dynamics, used=np.zeros(FRAMES, dtype=bool)), measured, mask)
    np.testing.assert_allclose(
        wrenches_by_motion(body, dynamics, measured, mask)[50:70], alone[50:70], atol=1e-6
    )


def test_torques_are_those_of_inverse_dynamics_under_these_wrenches(body, motion, measured):
    counts = WHOLE.copy()
    counts[GAP, 0] = False
    mask = FrameMask(counts)
    dynamics = inverse_dynamics(body, motion, measured, mask, SETTINGS)
    wrenches = wrenches_by_motion(body, dynamics, measured, mask)
    expected = inverse_dynamics(body, motion, contacts_of(FEET, wrenches), FrameMask(WHOLE), SETTINGS)
    ours = with_joint_torques(body, dynamics, measured, mask)
    np.testing.assert_allclose(ours.joint_torques, expected.joint_torques, atol=1e-9)
    np.testing.assert_array_equal(ours.wrench_is_predicted, ~counts)
    np.testing.assert_array_equal(ours.residual_root, dynamics.residual_root)
    np.testing.assert_allclose(ours.joint_torques[GAP][:, root_joint(body).dofs], 0, atol=1e-6)


def test_where_all_forces_count_nothing_is_predicted(body, motion, measured):
    mask = FrameMask(WHOLE)
    dynamics = inverse_dynamics(body, motion, measured, mask, SETTINGS)
    assert with_joint_torques(body, dynamics, measured, mask) is dynamics
