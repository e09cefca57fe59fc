"""Poses of a markerless system's segments, fitted: a real walk, and a simulated one whose motion is known."""

import ezc3d
import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from solver.capture.subject.opened_subject import open_subject
from solver.diagnosis.diagnose_subject import diagnose
from solver.fitting.pipeline import solve
from solver.fitting.settings import Settings
from solver.kinematics.frame_solver import PoseProblem, solve_frames
from solver.kinematics.settings import KinematicsSettings
from solver.simulate.laboratory import MeasurementSettings, measure, plates_under
from solver.simulate.person import Person, body_of
from solver.simulate.simulated_trial import Scenario, simulate_trial
from solver.simulate.subject_folder import write_subject
from solver.skeleton.forward import marker_positions
from tests.solver.capture.formats.test_segment_poses import RATE_HZ, poses_of, write_poses

REAL = "wild/theia_rotations_without_points"
FEATURES, FEATURE_ERROR_M, LASTS_S = 124, 0.011, 0.06  # each way; what such a system finds in its videos
LEGS = ("hip_flexion", "hip_adduction", "hip_rotation", "knee_angle", "ankle_angle", "lumbar_extension")


@pytest.mark.real
@pytest.mark.slow
def test_a_real_walk_has_the_angles_between_the_segments_of_its_file(real_data, recorded_fit):
    (trial,) = recorded_fit(REAL).trials
    assert trial.marker_errors.rms < 0.01
    file = ezc3d.c3d(str(real_data / REAL / "C3DRotationExample.c3d"))
    labels = file["parameters"]["ROTATION"]["LABELS"]["value"]
    R = {name[:-4]: file["data"]["rotations"][:3, :3, k].transpose(2, 0, 1) for k, name in enumerate(labels)}
    seen = trial.motion.posed
    assert seen.sum() == 335  # of 340
    for parent, child, dof, sign, off_deg in (
        ("thigh", "shank", "knee_angle", -1, 1.0),
        ("pelvis", "thigh", "hip_flexion", 1, 4.0),
        ("shank", "foot", "ankle_angle", 1, 5.0),
    ):
        for side in "rl":
            above = parent if parent == "pelvis" else f"{side}_{parent}"
            between = np.swapaxes(R[above][seen], 1, 2) @ R[f"{side}_{child}"][seen]
            theirs = sign * Rotation.from_matrix(between).as_euler("XYZ", degrees=True)[:, 0]
            ours = np.degrees(trial.motion.q[seen, trial.motion.dofs.index(f"{dof}_{side}")])
            assert np.corrcoef(ours, theirs)[0, 1] > 0.98
            assert abs(np.mean(ours - theirs)) < off_deg


@pytest.fixture(scope="module")
def walk():
    """A person, the walk, and the motion that the system's skeleton takes from features centimetres off."""
    person = Person(68.0, 1.72, "female", mass_scatter=0.0, com_scatter_m=0.0)
    body_rng, motion_rng, video_rng = np.random.default_rng(21).spawn(3)
    body = body_of(person, body_rng)
    trial = simulate_trial(Scenario("walk", "walk", duration=4.0), body, motion_rng)
    q = trial.frames(RATE_HZ).q
    some = video_rng.choice(len(body.skeleton.markers), FEATURES, replace=False)
    features = body.skeleton.with_markers([body.skeleton.markers[k] for k in sorted(some)])
    width = LASTS_S / np.sqrt(2) * RATE_HZ
    errors = gaussian_filter1d(video_rng.normal(size=(len(q), FEATURES, 3)), width, axis=0)
    errors *= FEATURE_ERROR_M / errors.std()
    problem = PoseProblem(features, marker_positions(features, q) + errors, KinematicsSettings())
    return person, trial, solve_frames(problem, q, np.arange(len(q)), robust=False)[0]


@pytest.mark.slow
def test_bands_hold_what_the_systems_own_skeleton_has_wrong_and_it_is_no_fault(walk, tmp_path):
    person, trial, q = walk
    plates = plates_under(trial.contacts, (0.0, trial.scenario.duration), missed=(3,))
    laboratory, rng = MeasurementSettings(marker_rate=RATE_HZ), np.random.default_rng(2)
    write_subject(tmp_path, person, [measure(trial, plates, ("C7",), laboratory, rng)])
    (tmp_path / "trials/walk/markers.trc").unlink()
    write_poses(tmp_path / "trials/walk/markers.c3d", poses_of(trial.body.skeleton, q))
    fit = solve(open_subject(tmp_path), Settings())
    (fitted,), dofs = fit.trials, fit.skeleton.dofs
    own = [k for k, dof in enumerate(dofs) if dof.startswith(LEGS)]
    theirs = [trial.body.skeleton.dofs.index(dofs[k]) for k in own]
    true = trial.frames(RATE_HZ)
    angle = fitted.motion.q[:, own] - true.q[:, theirs]
    angle -= angle.mean(axis=0)
    speed = fitted.motion.velocity[:, own] - true.velocity[:, theirs]
    for error, std in ((angle, fitted.std.angle), (speed, fitted.std.speed)):
        assert 0.9 < np.mean(np.abs(error) < 1.96 * std[:, own]) < 0.995
        assert std[:, own].mean() < 2 * error.std()
    assert [e.id for e in diagnose(open_subject(tmp_path), Settings()).effects] == ["off_plate_step"]
