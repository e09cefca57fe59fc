"""What a fit with a cause gains over one without: a clock 25 ms late, and causes that are none."""

import json
from dataclasses import replace

import numpy as np
import pytest

from solver.common.true_runs import runs
from solver.common.typed_json import plain
from solver.diagnosis.accepted_causes import extension_of
from solver.diagnosis.causes.clocks import ClockOffset
from solver.diagnosis.diagnosis_report import accepted_gain
from solver.diagnosis.extended_fit import SUB_BLOCK_S, _Fitted, _frames_held_out, _held_out, extended_fit
from solver.dynamics.trajectory.extension import BodyWrench, Extension, TrialExtension
from solver.dynamics.trajectory.trial_data import TrialData
from tests.solver.diagnosis.late_walk import LATE_S, SETTINGS, rms

pytestmark = pytest.mark.slow  # their fixtures take long


@pytest.fixture(scope="module")
def gain(late, late_extension):
    return extended_fit(late.fit, late_extension, SETTINGS)


@pytest.fixture(scope="module")
def gain_on_time(on_time):
    solved = on_time.solved(ClockOffset("all"), (0.0,))
    return extended_fit(on_time.fit, extension_of(on_time.balance.scenes, solved), SETTINGS)


def test_the_fit_finds_the_clock(gain, gain_on_time):
    """Skin and tables' inertias give every recording some offset; the delay is the difference of two."""
    found = gain.fit.extra[0] - gain_on_time.fit.extra[0]
    assert found == pytest.approx(LATE_S, rel=0.1)


def test_what_was_held_out_is_predicted_better(gain):
    for figure, drop in (
        (gain.held_out_linear_residual_N, gain.held_out_linear_drop_N),
        (gain.held_out_angular_residual_Nm, gain.held_out_angular_drop_Nm),
    ):
        assert figure.after < figure.before
        assert figure.interval[0] < figure.after < figure.interval[1]
        assert drop[0] < figure.before - figure.after < drop[1]
    assert gain.marker_rms_m.after <= gain.marker_rms_m.before + 1e-4


def test_an_extension_by_nothing_changes_nothing(on_time):
    nothing = BodyWrench(None, np.zeros((on_time.scene.frames, 6)), np.zeros((on_time.scene.frames, 6, 1)))
    known = np.ones(on_time.scene.frames, dtype=bool)
    trial = TrialExtension((nothing,), known, on_time.scene.counts)
    idle = Extension((), np.ones(1), np.zeros(1), {on_time.scene.name: trial})
    gain = extended_fit(on_time.fit, idle, SETTINGS)
    assert max(gain.joint_torque_change.values()) < 1e-6
    assert gain.held_out_linear_residual_N.before == pytest.approx(gain.held_out_linear_residual_N.after)
    assert gain.marker_rms_m.before == pytest.approx(gain.marker_rms_m.after)


def test_torques_move_to_those_of_the_recording_on_time(gain, gain_on_time):
    used = gain.after[0].used & gain_on_time.before[0].used
    right, wrong, corrected = (
        dynamics[0].joint_torques[used, 6:] for dynamics in (gain_on_time.before, gain.before, gain.after)
    )
    assert rms(corrected - right) < 0.5 * rms(wrong - right)


def test_the_json_part_is_plain_and_whole(gain):
    told = json.loads(json.dumps(plain(accepted_gain(gain, (), ())), allow_nan=False))
    assert None not in told["held_out_linear_residual_N"].values()
    assert told["mass_kg"]["interval"] is None
    change = told["joint_torque_change"]
    most = change["most_changed"]
    assert len(most) == 5
    assert most == sorted(change["rms"], key=lambda dof: -change["rms"][dof])[:5]
    assert not any(name.startswith("pelvis") for name in change["rms"])
    dof, own = most[0], gain.fit.skeleton.dofs.index(most[0])
    before, after = (of[0].joint_torques[of[0].used, own] for of in (gain.before, gain.after))
    assert change["before_rms"][dof] == pytest.approx(rms(before))
    assert change["rms"][dof] == pytest.approx(rms(after - before))


def test_forces_along_a_translation_are_not_listed_among_torques(gain):
    skeleton = gain.fit.skeleton
    dof = next(iter(gain.joint_torque_change))
    model = tuple(replace(c, motion="translation") if c.name == dof else c for c in skeleton.coordinates)
    sliding = replace(gain, fit=replace(gain.fit, skeleton=replace(skeleton, coordinates=model)))
    assert dof not in accepted_gain(sliding, (), ()).joint_torque_change.most_changed


def test_time_histories_of_their_own_are_held_out_key_findings_blocks(late):
    """A column that acts for 0.3 s is told by its neighbours only; one that always acts, by everything."""
    frames, rate = 400, 100.0
    columns = np.zeros((frames, 6, 2))
    columns[:, 0, 0] = 1.0
    columns[200:230, 1, 1] = 1.0
    part = BodyWrench(None, np.zeros((frames, 6)), columns)
    everywhere = np.ones(frames, dtype=bool)
    extra = TrialExtension((part,), everywhere, everywhere)
    start = replace(late.fit.trials[0].motion, q=np.zeros((frames, 3)), rate=rate)
    data = TrialData(np.zeros((frames, 0, 3)), np.zeros((frames, 6)), everywhere, start)
    held_out = runs(_frames_held_out(data, extra, SETTINGS))
    short = [end - start for start, end in held_out if start >= 200 and end <= 230]
    usual = [end - start for start, end in held_out if end <= 200]
    assert short and set(short) == {round(SUB_BLOCK_S * rate)}  # noqa: PT018 some, and all of that length
    assert set(usual) == {round(SETTINGS.trajectory.held_out_block_s * rate)}


def test_a_cause_that_takes_the_force_away_is_no_gain_and_said_so(on_time):
    """As if plates that read nothing and a person without weight were an explanation."""
    scene = on_time.scene
    gone = BodyWrench(None, -0.9 * scene.measured_ground, np.zeros((scene.frames, 6, 0)))
    trial = TrialExtension((gone,), np.ones(scene.frames, dtype=bool), scene.counts)
    silent = Extension((), np.zeros(0), np.zeros(0), {scene.name: trial})
    notes = extended_fit(on_time.fit, silent, SETTINGS).notes
    assert any("10 % of the recorded force" in note for note in notes)
    assert any("act on no segment in particular" in note for note in notes)


def test_too_few_blocks_have_no_interval_and_none_no_figure(gain):
    before, after = _Fitted(gain.fit, gain.before), _Fitted(gain.fit, gain.after)
    two, drop = _held_out([(0, 30, 50), (0, 90, 110)], before, after, slice(0, 3))
    frames = [*range(30, 50), *range(90, 110)]
    expected = np.sqrt((gain.after[0].residual_root[frames, :3] ** 2).sum(axis=1).mean())
    assert two.after == pytest.approx(expected)
    assert two.interval is None
    assert drop is None
    nothing, drop = _held_out([], before, after, slice(0, 3))
    nothing = replace(gain, held_out_linear_residual_N=nothing, held_out_linear_drop_N=drop)
    assert accepted_gain(nothing, (), ()).held_out_linear_residual_N is None
