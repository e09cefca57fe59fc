import numpy as np

from solver.kinematics.calibration import EFFECTIVE_STATIC_FRAMES, calibrate, choose_frames
from solver.kinematics.scale_prior import scale_groups, without_side
from solver.kinematics.settings import EFFECTIVE_FRAMES, KinematicsSettings
from solver.skeleton.forward import marker_positions
from solver.skeleton.scaling import scaled, with_offsets

SETTINGS = KinematicsSettings()


def test_recovers_scales_and_marker_offsets_of_a_synthetic_subject(crane, crane_q):
    rng = np.random.default_rng(2)
    groups = scale_groups(crane)
    truth = groups.factors(np.repeat(rng.normal(0.05, 0.05, groups.count), 3))
    offsets = rng.normal(0, 0.005, (len(crane.markers), 3))
    subject = with_offsets(scaled(crane, truth, None), offsets)
    observed = marker_positions(subject, crane_q)
    calibration = calibrate(crane, choose_frames([observed], None, SETTINGS), SETTINGS)
    knee = crane.body_index("femur_r")
    assert abs(calibration.factors[knee, 1] / truth[knee, 1] - 1) < 0.03
    error = np.linalg.norm(marker_positions(calibration.skeleton, crane_q) - observed, axis=2)
    before = np.linalg.norm(marker_positions(crane, crane_q) - observed, axis=2)
    assert np.sqrt((error**2).mean()) < 0.25 * np.sqrt((before**2).mean())


def test_one_bad_marker_does_not_change_the_bones(crane, crane_q):
    observed = marker_positions(crane, crane_q)
    observed[:, 8] += (0.25, 0.1, -0.2)
    calibration = calibrate(crane, choose_frames([observed], None, SETTINGS), SETTINGS)
    np.testing.assert_allclose(calibration.factors[crane.body_index("tibia_r")], 1.0, atol=0.03)


def test_unseen_bodies_follow_the_size_of_the_others(crane, crane_q):
    subject = scaled(crane, np.full((len(crane.bodies), 3), 1.15), None)
    keep = [i for i, m in enumerate(crane.markers) if crane.bodies[m.body].name != "arm_r"]
    observed = marker_positions(subject, crane_q)[:, keep]
    seen = crane.with_markers([crane.markers[i] for i in keep])
    calibration = calibrate(seen, choose_frames([observed], None, SETTINGS), SETTINGS)
    assert calibration.factors[crane.body_index("arm_r")].min() > 1.08


def test_counterparts_share_a_group():
    names = ["femur_r", "femur_l", "r_hand", "l_hand", "foot_right", "torso"]
    assert [without_side(n) for n in names] == ["femur", "femur", "hand", "hand", "foot", "torso"]


def test_calibration_frames_are_spread_over_all_trials_and_skip_gaps(crane, crane_q):
    first = marker_positions(crane, crane_q)
    second = first.copy()
    second[:45] = np.nan
    chosen = choose_frames([first, second], first[:10], SETTINGS)
    assert np.isfinite(chosen.observed_ground).all()
    assert len(chosen.observed_ground) == len(chosen.weight)
    assert abs(chosen.weight.sum() - EFFECTIVE_FRAMES - EFFECTIVE_STATIC_FRAMES) < 1e-9
