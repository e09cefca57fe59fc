"""A person's model from trial to trial: against the cost, against one calibration of all, and the truth."""

from dataclasses import replace

import numpy as np
import pytest

from solver.kinematics.calibration import BorderedSolver, Shared, calibrate, choose_frames
from solver.kinematics.frame_solver import solve_frames
from solver.kinematics.kept_calibration import kept_calibration
from solver.kinematics.settings import KinematicsSettings
from solver.skeleton.forward import marker_positions
from solver.skeleton.scaling import scaled, with_offsets

SETTINGS = KinematicsSettings(tolerance=1e-12, iterations=60)
MOVED_M, LARGER, SKIN_M = 0.03, 1.02, 0.003


@pytest.fixture(scope="module")
def recorded(crane, crane_q):
    """Markers of one person in two trials, with the skin's error of each frame."""
    rng = np.random.default_rng(8)
    person = with_offsets(scaled(crane, np.full((6, 3), 1.06)), rng.normal(0, 0.01, (len(crane.markers), 3)))
    markers = marker_positions(person, crane_q)
    return [markers[half] + rng.normal(0, SKIN_M, markers[half].shape) for half in (slice(45), slice(45, 90))]


@pytest.fixture(scope="module")
def kept(crane, recorded):
    return kept_calibration(calibrate(crane, choose_frames(recorded[:1], None, SETTINGS), SETTINGS), None, ())


def tracked(kept, markers, start):
    """Frames of a trial, and the kept model's poses on them."""
    frames = choose_frames([markers], None, SETTINGS)
    solver = BorderedSolver(kept.generic, frames, kept.groups, SETTINGS)
    every = np.arange(len(frames.weight))
    q, cost = solve_frames(solver.problem(kept.shared), start[frames.places[0]], every)
    return frames, q, cost @ frames.weight


def test_evidence_is_the_slope_of_the_cost_at_its_best_poses(kept, recorded, crane_q):
    kept = replace(kept, shared=Shared(kept.shared.log_scale, 0 * kept.shared.offsets))
    frames, q, _ = tracked(kept, recorded[1], crane_q[45:])
    gradient = BorderedSolver(kept.generic, frames, kept.groups, SETTINGS).evidence(kept.shared, q).gradient
    each, scales = np.eye(len(gradient)), kept.groups.size
    for way, step in ((each[:scales].sum(axis=0), 1e-3), (each[scales + 4], 1e-4), (each[-3], 1e-4)):
        beside = [replace(kept, shared=kept.shared.moved(s * step * way)) for s in (1, -1)]
        ahead, behind = (tracked(at, recorded[1], crane_q[45:])[2] for at in beside)
        assert gradient @ way == pytest.approx((ahead - behind) / (4 * step), rel=1e-3)  # of half the cost


def test_a_second_trial_of_the_same_person_makes_the_model_that_both_make_together(kept, recorded, crane_q):
    refined = kept.refined(*tracked(kept, recorded[1], crane_q[45:])[:2], SETTINGS)
    both = calibrate(kept.generic, choose_frames(recorded, None, SETTINGS), SETTINGS).shared
    before, after = (np.abs(one.shared.vector - both.vector).max() for one in (kept, refined))
    assert after < 0.5 * before
    again = refined.refined(*tracked(refined, recorded[1], crane_q[45:])[:2], SETTINGS)
    assert again.trials == 3


@pytest.mark.parametrize("marker", [None, 8])
def test_another_body_or_a_marker_put_on_anew_is_seen(kept, recorded, crane_q, marker):
    markers = recorded[1].copy()
    if marker is None:
        markers *= LARGER
    else:
        markers[:, marker, 1] += MOVED_M
    start = crane_q[45:].copy()
    start[:, 3:6] *= 1 if marker else LARGER
    assert kept.refined(*tracked(kept, markers, start)[:2], SETTINGS) is None
