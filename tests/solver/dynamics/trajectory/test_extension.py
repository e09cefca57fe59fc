import numpy as np
import pytest

from solver.contact.wrenches import FrameMask
from solver.dynamics.force_prediction.missing_wrench import with_joint_torques
from solver.dynamics.inverse_dynamics import inverse_dynamics
from solver.dynamics.settings import DynamicsSettings
from solver.dynamics.trajectory.extension import (
    BodyWrench,
    Cause,
    Extension,
    TrialExtension,
    with_extra_wrench,
)
from solver.dynamics.trajectory.trial_data import TrialData
from solver.kinematics.label_faults.fault import Exchange
from solver.kinematics.motion import Motion
from tests.contacts import contacts_of

FRAMES = 30


@pytest.fixture
def motion(crane, crane_q):
    return Motion(crane.dofs, crane_q[:FRAMES], 50.0)


@pytest.fixture
def extra():
    rng = np.random.default_rng(3)
    parts = tuple(
        BodyWrench(body, rng.normal(0, 20, (FRAMES, 6)), rng.normal(0, 10, (FRAMES, 6, 2)))
        for body in ("foot_r", "arm_r", None)
    )
    known = np.ones(FRAMES, dtype=bool)
    known[12] = False
    return TrialExtension(parts, known, np.ones(FRAMES, dtype=bool))


def test_torques_are_those_under_the_wrenches_as_contacts(crane, motion, extra):
    """Inverse dynamics told of the same wrenches from the start."""
    x, settings = np.array([1.5, -0.7]), DynamicsSettings()
    mask = FrameMask(np.ones((FRAMES, 1), dtype=bool))
    foot = np.random.default_rng(1).normal(0, 50, (FRAMES, 1, 6))
    contacts = contacts_of(["foot_r"], foot)
    explained = with_extra_wrench(inverse_dynamics(crane, motion, contacts, mask, settings), extra, x)
    ours = with_joint_torques(crane, explained, contacts, mask, acting=extra.loads(x))
    foot_part, arm_part, nowhere = (part.at(x) for part in extra.parts)
    told = contacts_of(["foot_r", "arm_r"], np.stack([foot[:, 0] + foot_part, arm_part], axis=1))
    mask = FrameMask(np.ones((FRAMES, 2), dtype=bool))
    expected = inverse_dynamics(crane, motion, told, mask, settings)
    joints = [
        d for d, name in enumerate(crane.dofs) if name not in {"tx", "ty", "tz", "tilt", "list", "turn"}
    ]
    np.testing.assert_allclose(ours.joint_torques[:, joints], expected.joint_torques[:, joints], atol=1e-9)
    moment = nowhere[:, 3:] - np.cross(expected.root_ground, nowhere[:, :3])
    np.testing.assert_allclose(
        ours.residual_root,
        expected.residual_root - np.concatenate([nowhere[:, :3], moment], axis=1),
        atol=1e-8,
    )
    assert ours.used.sum() == expected.used.sum() - 1


def test_the_whole_is_the_sum_of_its_parts(motion, extra):
    data = TrialData(np.zeros((FRAMES, 1, 3)), np.zeros((FRAMES, 6)), np.ones(FRAMES, dtype=bool), motion)
    given = extra.added_to(data, gain=1.25)
    np.testing.assert_allclose(given.extra_wrench_ground, sum(p.fixed_ground for p in extra.parts) / 1.25)
    np.testing.assert_allclose(given.extra_columns_ground, sum(p.columns_ground for p in extra.parts) / 1.25)
    np.testing.assert_array_equal(given.counts, extra.known)


def test_its_causes_in_words():
    causes = (Cause("clock_offset", "all", {"offset_s": (0.01, 0.001)}), Cause("plate_gain", "plate_2", {}))
    assert Extension(causes, np.ones(1), np.zeros(1)).sentence == "clock_offset (all), plate_gain (plate_2)"


def test_exchanged_labels_are_named_once_a_pair_and_change_the_fingerprint():
    pair = tuple(Exchange("walk", ("A", "B"), start, start + 5) for start in (10, 40))
    nothing = Extension((), np.zeros(0), np.zeros(0))
    swapped = Extension((), np.zeros(0), np.zeros(0), exchanges=pair)
    assert swapped.sentence == "marker_swap (A+B)"
    assert swapped.parameters is None
    assert swapped.fingerprint != nothing.fingerprint
    assert swapped.fingerprint != Extension((), np.zeros(0), np.zeros(0), exchanges=pair[:1]).fingerprint
