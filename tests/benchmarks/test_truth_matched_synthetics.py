"""A matched synthetic moves as it says, under the forces of its motion, with the noise of its recording."""

import numpy as np
import pytest

from benchmarks.truth import matched_synthetics
from benchmarks.truth.figures import error_by_band
from benchmarks.truth.recorded import solved
from benchmarks.truth.tables import matched_synthetic_bands
from benchmarks.truth.ways import OURS, at_cutoff, time_history_of, torques_of
from solver.dynamics.material_acceleration import required_ground
from solver.kinematics.motion import Motion
from solver.skeleton.forward import marker_positions
from solver.skeleton.scaling import with_mass

FOLDER = "walk_gait2354_subject01"


@pytest.mark.real
def test_a_matched_synthetic_of_a_walk(real_data, monkeypatch):
    if not (real_data / FOLDER).is_dir():
        pytest.skip(f"{FOLDER} not among the recordings")
    monkeypatch.setenv("ADDB_DATA", str(real_data))
    fit, settings = solved(FOLDER)
    trial = fit.trials[0]
    known = trial.forces_known
    calm = matched_synthetics.made(fit, trial, trial.motion, settings)
    # Its forces miss what the recorded ones miss of the same motion: they are the recorded ones.
    np.testing.assert_allclose(
        calm.before.contacts.wrench_ground[known], trial.contacts.wrench_ground[known], atol=1e-6
    )
    for kind, level in (("slow", calm.slow), ("growth", calm.growth)):
        assert level[1] == pytest.approx(level[0], rel=0.25), kind
    observed = fit.groundwork.match.observed(calm.before.capture.markers)
    recorded = fit.groundwork.match.observed(trial.capture.markers)
    np.testing.assert_array_equal(np.isfinite(observed), np.isfinite(recorded))
    body = with_mass(fit.groundwork.skeleton, fit.groundwork.mass_kg)
    off = np.linalg.norm(observed - marker_positions(body, trial.motion.q), axis=2)
    assert 0.002 < np.sqrt(np.nanmean(off**2)) < 0.03

    lively = trial.kinematics_only.motion.low_passed(matched_synthetics.LIVELY_HZ["walk"])
    matched_synthetic = matched_synthetics.made(fit, trial, lively, settings)
    missed = trial.contacts.wrench_ground.sum(axis=1) - required_ground(fit.skeleton, trial.motion)
    total = matched_synthetic.before.contacts.wrench_ground.sum(axis=1) - missed
    # Newton and Euler: under the true wrench of both feet nothing is left at the root.
    left = torques_of(fit.skeleton, lively, total[:, None], trial.contacts.foot_bodies[:1])
    assert np.abs(left[known][:, :6]).max() < 1e-6


def test_bands_tell_who_is_nearer():
    times = np.arange(400) / 100
    true = np.stack([0.5 * np.sin(2 * np.pi * times), 0.1 * np.sin(2 * np.pi * 5 * times)]).sum(axis=0)

    def time_history(q):
        return time_history_of(Motion(("knee_angle_r", "knee_angle_l"), np.stack([q, q], axis=1), 100.0))

    at_5_Hz = 0.02 * np.sin(2 * np.pi * 5 * times + 1)
    errors = error_by_band(time_history(true + at_5_Hz), time_history(true))["knee"]
    in_band = {e["low_Hz"]: e["error_deg"] for e in errors}
    assert in_band[4.0] == pytest.approx(np.degrees(0.02 / np.sqrt(2)), rel=0.1)
    assert in_band[0.5] < 0.1 * in_band[4.0]
    run = {
        "gains_of_recording": {"knee": [{"low_Hz": 4.0, "high_Hz": 6.0, "gain": 0.8}]},
        "gains": {"truth": {"knee": [{"gain": 0.7}]}},
        "errors_by_band": {
            OURS: {"knee": [{"error_deg": 0.1}]},
            at_cutoff(6.0): {"knee": [{"error_deg": 0.2}]},
            at_cutoff(8.0): {"knee": [{"error_deg": 0.3}]},
        },
    }
    worse = {**run, "errors_by_band": {**run["errors_by_band"], OURS: {"knee": [{"error_deg": 0.25}]}}}
    nearer, not_nearer = (
        matched_synthetic_bands([run, run], 6.0)[0],
        matched_synthetic_bands([run, worse], 6.0)[0],
    )
    assert nearer.is_bent
    assert nearer.is_nearer
    assert nearer.markers_deg == (0.2, 0.2)
    assert not not_nearer.is_nearer
    assert matched_synthetic_bands([run, run], 4.0) == []
