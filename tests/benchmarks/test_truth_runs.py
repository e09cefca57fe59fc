"""The truths of the bench are true, and every way comes from the recording it says."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.truth import recorded, simulated, synthetic_subject
from benchmarks.truth.figures import figures, inner
from benchmarks.truth.tables import pooled
from benchmarks.truth.ways import LABORATORY, MARKER_FIT, OURS, all_ways, bench_settings, feet_wrenches
from solver.fitting.pipeline import solve
from solver.skeleton.forward import marker_positions
from solver.skeleton.pinocchio_model import RigidBodyModel


@pytest.fixture
def synthetic(real_data, monkeypatch):
    if not (real_data / synthetic_subject.FOLDER).is_dir():
        pytest.skip(f"{synthetic_subject.FOLDER} not among the recordings")
    monkeypatch.setenv("ADDB_DATA", str(real_data))
    synthetic_subject.recording.cache_clear()
    return synthetic_subject.recording()


@pytest.mark.real
def test_the_synthetic_walk_is_what_its_coordinates_say(synthetic):
    """The generating model posed by coordinates.sto carries its markers where the file has them."""
    _, capture, model = synthetic
    time_history = synthetic_subject.true_time_history(model, capture)
    posed = marker_positions(model, time_history.angle)
    columns = [capture.markers.names.index(m.name) for m in model.markers if m.name in capture.markers.names]
    ours = [i for i, m in enumerate(model.markers) if m.name in capture.markers.names]
    assert len(ours) > 40
    apart = np.linalg.norm(posed[:, ours] - capture.markers.positions_ground[:, columns], axis=2)
    assert apart.max() < 1e-4
    off = [f["rms"] for f in synthetic_subject.referee().values()]
    assert max(off) < 1.0  # N·m, from OpenSim's inverse dynamics


@pytest.mark.real
def test_ways_on_exact_markers(synthetic):
    """The marker fit is nearly exact, the laboratory loses what its filter takes, forces are as recorded."""
    subject, capture, model = synthetic
    settings = bench_settings()
    fit = solve(subject, settings)
    trial = fit.trials[0]
    ways = all_ways(fit, trial, settings, "walk", model)
    truth = synthetic_subject.true_time_history(model, capture)
    run = {"ways": {n: figures(c, truth, ways.forces_count) for n, c in ways.time_histories.items()}}
    assert pooled([run], MARKER_FIT, "angle") < 0.1
    assert 0.1 < pooled([run], LABORATORY, "angle") < 0.5
    assert pooled([run], OURS, "torque") is not None
    own = replace(settings.conditioning)
    np.testing.assert_allclose(
        feet_wrenches(trial, own)[inner(trial.motion.frames, trial.motion.rate)],
        trial.contacts.wrench_ground[inner(trial.motion.frames, trial.motion.rate)],
        atol=1e-6,
    )


@pytest.mark.slow
@pytest.mark.real
def test_references_are_on_the_trials_frames_in_radians(real_data, monkeypatch):
    monkeypatch.setenv("ADDB_DATA", str(real_data))
    reference = next(r for r in recorded.REFERENCES if r.folder == "opencap_subject6")
    if not (real_data / reference.folder).is_dir():
        pytest.skip("opencap_subject6 not among the recordings")
    runs = [r for r in recorded.runs(reference.folder) if r["kind"] == "reference"]
    assert [r["angles"] for r in runs] == [reference.angles]
    assert pooled(runs, MARKER_FIT, "angle", ("knee_angle_r", "knee_angle_l"), "rms_without_offset") < 3.0
    assert runs[0]["ways"][OURS]["angle"]["hip_flexion_r"]["range"] > 30.0


@pytest.mark.parametrize("person", range(simulated.PERSONS))
def test_wrong_masses_are_up_to_seven_per_cent_off_and_weigh_the_same(person):
    truth = simulated.made("squat", person)
    nominal, real = truth.model, truth.trial.body.skeleton
    ratio = np.array([r.mass / n.mass for r, n in zip(real.bodies, nominal.bodies, strict=True)])
    assert np.abs(ratio - 1).max() == pytest.approx(0.07)
    assert real.mass == pytest.approx(nominal.mass)
    by_name = dict(zip(real.body_names, ratio, strict=True))
    assert by_name["femur_r"] == pytest.approx(by_name["femur_l"])


def test_true_torques_leave_nothing_at_the_root_and_hold_the_standing_leg():
    truth = simulated.made("squat", 0)
    time_history = simulated.true_time_history(truth.trial, 100.0)
    weight = truth.trial.body.skeleton.mass * 9.80665
    assert np.abs(time_history.torque[:, :6]).max() < 1e-6 * weight
    feet = [truth.trial.body.skeleton.body_index(name) for name in simulated.FEET]
    q, v, a = truth.trial.motion.state(np.arange(len(time_history.angle)) / 100.0)
    wrench = truth.trial.reactions(np.arange(len(time_history.angle)) / 100.0).wrench_ground
    expected = RigidBodyModel(truth.trial.body.skeleton).inverse_dynamics(q, v, a, wrench, feet)
    np.testing.assert_allclose(time_history.torque, expected)


def test_a_simulated_recording_is_exact_but_for_its_skin():
    truth = simulated.made("squat", 1)
    exact = simulated.recorded(truth.trial, simulated.MARKERS, 100.0, 0.0, 1)
    moved = simulated.recorded(truth.trial, simulated.MARKERS, 100.0, 5.0, 1)
    skeleton = truth.trial.body.skeleton
    columns = [skeleton.marker_names.index(n) for n in simulated.MARKERS]
    posed = marker_positions(skeleton, truth.trial.frames(100.0).q)[:, columns]
    np.testing.assert_allclose(exact.markers.positions_ground, posed, atol=1e-12)
    off = moved.markers.positions_ground - posed
    assert np.sqrt(np.mean((off**2).sum(axis=2))) == pytest.approx(0.005)
    assert len(exact.plates) == 2
