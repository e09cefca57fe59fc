"""Inverse dynamics against the change of linear and angular momentum, made from body poses alone."""

from dataclasses import replace

import numpy as np
import pytest

from solver.common.errors import FitError, ModelError
from solver.contact.wrenches import ContactWrenches, FrameMask
from solver.dynamics.inverse_dynamics import inverse_dynamics
from solver.dynamics.settings import DynamicsSettings
from solver.kinematics.motion import Motion
from solver.skeleton.forward import body_poses
from solver.skeleton.functions import Constant, Linear
from solver.skeleton.rotations import body_fixed_xyz, skew
from solver.skeleton.skeleton import Axis, Body, Coordinate, Joint, Skeleton
from tests.contacts import contacts_of

RATE = 250.0  # [Hz]
SETTINGS = DynamicsSettings()


@pytest.fixture
def jumper() -> Skeleton:
    """A pelvis that turns about z, x, y off its origin, with a thigh and a foot, all in skew frames."""
    rotations = zip(np.eye(3)[[2, 0, 1]], ("tilt", "list", "turn"), strict=True)
    translations = zip(np.eye(3), ("tx", "ty", "tz"), strict=True)
    root = (
        *(Axis("translation", axis, Linear(1.0, 0.0), name) for axis, name in translations),
        *(Axis("rotation", axis, Linear(1.0, 0.0), name) for axis, name in rotations),
    )
    hinge = np.array([0.3, 0.1, 0.9])
    skewed = body_fixed_xyz(np.array([0.2, -0.5, 0.8]))
    names = ("tilt", "list", "turn", "tx", "ty", "tz", "hip", "ankle")
    return Skeleton(
        name="jumper",
        bodies=(
            Body("pelvis", 11.0, np.array([-0.07, 0.02, 0.01]), np.diag([0.10, 0.08, 0.06])),
            Body("thigh", 9.0, np.array([0.0, -0.17, 0.02]), skewed @ np.diag([0.13, 0.03, 0.14]) @ skewed.T),
            Body("foot", 1.2, np.array([0.1, -0.02, 0.0]), np.diag([0.001, 0.004, 0.004])),
        ),
        joints=(
            Joint("root", -1, np.eye(3), np.zeros(3), skewed, np.array([0.03, -0.06, 0.02]), root),
            _hinge("hip", 0, np.array([-0.05, -0.06, 0.08]), skewed, hinge),
            _hinge("ankle", 1, np.array([0.0, -0.42, 0.0]), np.eye(3), np.array([0.0, 0.0, 1.0])),
        ),
        coordinates=tuple(Coordinate(name, "rotation", 0.0, (-10.0, 10.0)) for name in names),
        markers=(),
    )


def _hinge(name, parent, where, R_child_frame, axis) -> Joint:
    axes = (Axis("rotation", axis, Linear(1.0, 0.0), name),)
    return Joint(name, parent, np.eye(3), where, R_child_frame, np.zeros(3), axes)


def _pose(skeleton: Skeleton, times: np.ndarray) -> np.ndarray:
    """A lively motion: every dof swings about its own mean at its own pace."""
    k = np.arange(len(skeleton.dofs))
    return 0.4 * np.sin(k) + (0.2 + 0.05 * k) * np.sin(2 * np.pi * (0.9 + 0.15 * k) * times[:, None] + k)


def _motion(skeleton: Skeleton, seconds: float = 1.2) -> Motion:
    times = np.arange(round(seconds * RATE)) / RATE
    return Motion(skeleton.dofs, _pose(skeleton, times), RATE)


def _contacts(frames: int, wrench: np.ndarray | None = None) -> ContactWrenches:
    wrenches = np.zeros((frames, 1, 6)) if wrench is None else wrench
    there = np.ones((frames, 1), dtype=bool)
    return contacts_of(("foot",), wrenches, in_contact=there, wrench_raw_ground=1.5 * wrenches)


def _counting(frames: int) -> FrameMask:
    return FrameMask(np.ones((frames, 1), dtype=bool))


def _momentum_rate(skeleton: Skeleton, times: np.ndarray) -> np.ndarray:
    """d/dt of [linear momentum, angular momentum about the ground origin], less gravity's wrench.

    Only positions and orientations enter; velocities and rates are differences over 50 µs.
    """
    step = 5e-5
    force_moment = (_momentum(skeleton, times + step, step) - _momentum(skeleton, times - step, step)) / (
        2 * step
    )
    R, p = body_poses(skeleton, _pose(skeleton, times))
    for b, body in enumerate(skeleton.bodies):
        weight = body.mass * skeleton.gravity
        arm = p[:, b] + R[:, b] @ body.com_body
        force_moment -= np.hstack([np.tile(weight, (len(times), 1)), np.cross(arm, weight)])
    return force_moment


def _momentum(skeleton: Skeleton, times: np.ndarray, step: float) -> np.ndarray:
    (R0, p0), (R1, p1) = (body_poses(skeleton, _pose(skeleton, times + s)) for s in (-step, step))
    R, p = body_poses(skeleton, _pose(skeleton, times))
    total = np.zeros((len(times), 6))
    for b, body in enumerate(skeleton.bodies):
        velocity = (p1[:, b] + R1[:, b] @ body.com_body - p0[:, b] - R0[:, b] @ body.com_body) / (2 * step)
        spin = (R1[:, b] - R0[:, b]) / (2 * step) @ np.swapaxes(R[:, b], 1, 2)
        angular = 0.5 * np.stack(
            [spin[:, 2, 1] - spin[:, 1, 2], spin[:, 0, 2] - spin[:, 2, 0], spin[:, 1, 0] - spin[:, 0, 1]],
            axis=1,
        )
        inertia = R[:, b] @ body.inertia_body @ np.swapaxes(R[:, b], 1, 2)
        momentum = body.mass * velocity
        moment = (
            np.cross(p[:, b] + R[:, b] @ body.com_body, momentum) + (inertia @ angular[..., None])[..., 0]
        )
        total += np.hstack([momentum, moment])
    return total


def test_residual_is_the_change_of_momentum_less_the_measured_wrench(jumper):
    motion = _motion(jumper)
    rng = np.random.default_rng(3)
    wrench = np.repeat(rng.normal(size=(1, 1, 6)) * [50, 300, 50, 20, 20, 20], motion.frames, axis=0)
    found = inverse_dynamics(
        jumper, motion, _contacts(motion.frames, wrench), _counting(motion.frames), SETTINGS
    )
    expected = _momentum_rate(jumper, motion.times) - wrench[:, 0]
    expected[:, 3:] -= np.cross(found.root_ground, expected[:, :3])
    middle = slice(30, -30)
    assert np.abs(expected[middle]).max() > 100  # the motion is no trifle
    np.testing.assert_allclose(found.residual_root[middle], expected[middle], atol=2e-3)


def test_the_moment_is_about_the_root_joints_centre_not_the_pelvis_origin(jumper):
    motion = _motion(jumper)
    found = inverse_dynamics(jumper, motion, _contacts(motion.frames), _counting(motion.frames), SETTINGS)
    translations = motion.q[:, [jumper.dofs.index(name) for name in ("tx", "ty", "tz")]]
    np.testing.assert_allclose(found.root_ground, translations, atol=1e-12)


def test_joint_torques_do_the_power_that_changes_the_energy(jumper):
    """Σ τ q̇ over all dofs, root included, is the rate of kinetic plus potential energy."""
    motion = _motion(jumper)
    found = inverse_dynamics(jumper, motion, _contacts(motion.frames), _counting(motion.frames), SETTINGS)
    power = np.sum(found.joint_torques * motion.velocity, axis=1)
    energy = [_energy(jumper, motion.times + s) for s in (-2e-4, 2e-4)]
    middle = slice(30, -30)
    np.testing.assert_allclose(power[middle], ((energy[1] - energy[0]) / 4e-4)[middle], atol=0.01)


def _energy(skeleton: Skeleton, times: np.ndarray) -> np.ndarray:
    step = 5e-5
    (R0, p0), (R1, p1) = (body_poses(skeleton, _pose(skeleton, times + s)) for s in (-step, step))
    total = np.zeros(len(times))
    for b, body in enumerate(skeleton.bodies):
        ends = [p[:, b] + R[:, b] @ body.com_body for R, p in ((R0, p0), (R1, p1))]
        velocity = (ends[1] - ends[0]) / (2 * step)
        spin = np.swapaxes(R0[:, b], 1, 2) @ (R1[:, b] - R0[:, b]) / (2 * step)
        angular = 0.5 * np.stack(
            [spin[:, 2, 1] - spin[:, 1, 2], spin[:, 0, 2] - spin[:, 2, 0], spin[:, 1, 0] - spin[:, 0, 1]],
            axis=1,
        )
        total += 0.5 * body.mass * np.sum(velocity**2, axis=1)
        total += 0.5 * np.einsum("ti,ij,tj->t", angular, body.inertia_body, angular)
        total -= body.mass * (ends[0] + ends[1]) / 2 @ skeleton.gravity
    return total


def test_com_is_the_weighted_mean_of_the_bodies(jumper):
    motion = _motion(jumper, 0.2)
    found = inverse_dynamics(jumper, motion, _contacts(motion.frames), _counting(motion.frames), SETTINGS)
    R, p = body_poses(jumper, motion.q)
    centres = [p[:, b] + R[:, b] @ body.com_body for b, body in enumerate(jumper.bodies)]
    masses = [body.mass for body in jumper.bodies]
    np.testing.assert_allclose(found.com_ground, np.average(centres, axis=0, weights=masses), atol=1e-12)


def test_raw_residual_differs_by_what_conditioning_took_away(jumper):
    motion = _motion(jumper, 0.4)
    wrench = np.tile([10.0, 500.0, -20.0, 1.0, 2.0, 3.0], (motion.frames, 1, 1))
    found = inverse_dynamics(
        jumper, motion, _contacts(motion.frames, wrench), _counting(motion.frames), SETTINGS
    )
    missing = -0.5 * wrench[:, 0]  # the raw forces of `_contacts` are half as large again
    np.testing.assert_allclose(found.residual_raw_root[:, :3] - found.residual_root[:, :3], missing[:, :3])
    moment = missing[:, 3:] - (skew(found.root_ground) @ missing[:, :3, None])[..., 0]
    np.testing.assert_allclose(found.residual_raw_root[:, 3:] - found.residual_root[:, 3:], moment)


def test_a_force_that_does_not_count_enters_neither_torques_nor_figures(jumper):
    motion = _motion(jumper, 0.4)
    wrench = np.tile([10.0, 500.0, -20.0, 1.0, 2.0, 3.0], (motion.frames, 1, 1))
    counts = np.ones((motion.frames, 1), dtype=bool)
    counts[40:50] = False
    masked = inverse_dynamics(jumper, motion, _contacts(motion.frames, wrench), FrameMask(counts), SETTINGS)
    without = inverse_dynamics(jumper, motion, _contacts(motion.frames), _counting(motion.frames), SETTINGS)
    np.testing.assert_allclose(masked.joint_torques[40:50], without.joint_torques[40:50])
    assert not np.allclose(masked.joint_torques[39], without.joint_torques[39])
    assert not masked.used[40:50].any()
    assert masked.used[[39, 50]].all()


def test_ends_and_unrecorded_frames_are_not_used(jumper):
    motion = _motion(jumper, 0.4)
    contacts = _contacts(motion.frames)
    observed = contacts.observed.copy()
    observed[:17] = False
    settings = replace(SETTINGS, end_frames=10)
    used = inverse_dynamics(
        jumper, motion, replace(contacts, observed=observed), _counting(motion.frames), settings
    ).used
    np.testing.assert_array_equal(np.flatnonzero(used), np.arange(17, motion.frames - 10))


def test_a_short_trial_keeps_its_middle(jumper):
    motion = _motion(jumper, 12 / RATE)
    used = inverse_dynamics(jumper, motion, _contacts(12), _counting(12), SETTINGS).used
    np.testing.assert_array_equal(np.flatnonzero(used), np.arange(3, 9))


def test_a_root_that_cannot_move_freely_is_an_error(jumper):
    root = jumper.joints[0]
    held = tuple(
        replace(a, function=Constant(0.0), coordinate=None) if a.coordinate == "tz" else a for a in root.axes
    )
    coordinates = tuple(c for c in jumper.coordinates if c.name != "tz")
    fixed = replace(jumper, joints=(replace(root, axes=held), *jumper.joints[1:]), coordinates=coordinates)
    with pytest.raises(ModelError, match="root joint 'root'"):
        inverse_dynamics(fixed, _motion(fixed, 0.1), _contacts(25), _counting(25), SETTINGS)


def test_forces_of_another_length_are_an_error(jumper):
    with pytest.raises(FitError, match="25 frames, forces 24"):
        inverse_dynamics(jumper, _motion(jumper, 0.1), _contacts(24), _counting(24), SETTINGS)
