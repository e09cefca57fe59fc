"""A trial beyond the border is fitted in windows: torques and residuals are those of the fit as a whole."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from solver.capture.subject.opened_subject import open_subject
from solver.dynamics.trajectory.trajectory_fit import fit_trajectories
from solver.fitting.mass_stage import estimate_mass_and_gains
from solver.fitting.pipeline import resolve, solve
from solver.fitting.trajectory_stage import all_data, begin_at_forces
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.scaling import with_mass
from tests.conftest import NO_HELD_OUT as WHOLE
from tests.flagged import flagged

FOLDER = "walk_treadmill_stepwidth"  # 501 frames
BAND = 6  # blocks of dofs × dofs per frame, for knots at every frame
POSES = 24e6  # bytes: of frames that are looked at together. Two systems are 46e6, one is 25e6
ROOT = 6  # dofs that place the body in the ground
TORQUE_NM, FORCE_N, MOMENT_NM = 1.0, 1.0, 1.0  # RMS
SHORT_WINDOWS = replace(
    WHOLE.trajectory,
    whole_frames=400,
    inertia_frames=400,
    stretch_frames=200,
    window_frames=360,
    overlap_frames=200,
)
WINDOWED = replace(WHOLE, trajectory=SHORT_WINDOWS)

pytestmark = [pytest.mark.real, pytest.mark.slow]  # their fixtures take long


@pytest.fixture(scope="module")
def subject(real_data):
    return open_subject(real_data / FOLDER)


@pytest.fixture(scope="module")
def whole(subject):
    return solve(subject, WHOLE)


@pytest.fixture(scope="module")
def windowed(subject):
    return solve(subject, WINDOWED)


def rms(values):
    return float(np.sqrt(np.mean(values**2)))


def assert_within_the_bound(one, other):
    """RMS over frames and joints, over frames and axes."""
    (a,), (b,) = one.trials, other.trials
    torques = a.dynamics.joint_torques - b.dynamics.joint_torques
    residual = (a.dynamics.residual_root - b.dynamics.residual_root)[a.dynamics.used]

    assert rms(torques[:, ROOT:]) < TORQUE_NM
    assert rms(residual[:, :3]) < FORCE_N
    assert rms(residual[:, 3:]) < MOMENT_NM


def test_windows_agree_with_the_whole(whole, windowed):
    assert (windowed.groundwork.phi != whole.groundwork.phi).any()  # taught by some of the frames
    assert_within_the_bound(whole, windowed)


def given(fit):
    """Body and data of its trajectory fit."""
    (trial,) = fit.trials
    before = replace(trial, motion=trial.kinematics_only.motion)
    told = estimate_mass_and_gains([before], fit.skeleton, WHOLE)
    data = all_data([before], fit.groundwork.match, told, None)
    body = with_mass(fit.skeleton, told.mass_kg)
    return body, [begin_at_forces(data[0], before, body, WHOLE)]


def test_inertias_given_windows_are_the_whole(whole, subject):
    """What windows by themselves change: next to nothing, at their borders too."""
    body, data = given(whole)
    ends = 1e-9  # searched to the end
    one, other = (
        fit_trajectories(body, data, replace(settings, fit_inertias=False, tolerance=ends, iterations=6))
        for settings in (WHOLE.trajectory, SHORT_WINDOWS)
    )
    (a,), (b,) = one.motions, other.motions
    model = RigidBodyModel(body)
    torques = [model.inverse_dynamics(m.q, m.velocity, m.acceleration) for m in (a, b)]

    assert np.degrees(np.abs(a.q - b.q).max()) < 0.05
    assert np.abs(torques[0] - torques[1])[:, ROOT:].max() < 0.1


def test_memory_holds_the_system_of_one_window_at_a_time(whole):
    body, data = given(whole)
    once, dofs = replace(SHORT_WINDOWS, iterations=1), len(body.dofs)
    tracemalloc.start()
    try:
        phi = fit_trajectories(body, data, once).phi
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    largest = max(once.inertia_frames, once.window_frames)

    assert peak < 8 * largest * (BAND * dofs**2 + dofs * len(phi)) + POSES


def test_a_flag_in_windows_agrees_with_the_same_flag_in_the_whole(subject, whole, windowed):
    (trial,) = whole.trials
    reviews = {trial.capture.name: flagged((220, 262, trial.contacts.foot_bodies[0], "missingForce"))}
    assert_within_the_bound(resolve(whole, reviews, WHOLE), resolve(windowed, reviews, WINDOWED))
