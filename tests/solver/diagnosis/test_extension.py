"""A walk whose forces were recorded 25 ms late, beside the same walk recorded with one clock."""

import json
from dataclasses import dataclass, replace

import numpy as np
import pytest

from solver.capture.subject import open_subject
from solver.diagnosis.balance import Balance, Solved
from solver.diagnosis.diagnose import balance_of
from solver.diagnosis.extended_fit import (
    SUB_BLOCK_S,
    _Fitted,
    _heldout,
    _withheld,
    extended_fit,
)
from solver.diagnosis.extension import causes_of, extension_of
from solver.diagnosis.refinement import refined
from solver.diagnosis.report import extended_gain_json
from solver.diagnosis.scenes import scenes_of
from solver.dynamics.extension import BodyWrench, Extension, TrialExtension
from solver.dynamics.trial_data import TrialData
from solver.effects.carried_mass import CarriedMass
from solver.effects.clock_offset import ClockOffset
from solver.effects.plate_gain import PlateGain
from solver.fit import Fit
from solver.pipeline import solve
from solver.runs import runs
from solver.settings import Settings
from solver.simulate.demo import MARKERS
from solver.simulate.laboratory import MeasurementSettings, measure, plates_under
from solver.simulate.person import Person, body_of
from solver.simulate.subject_folder import write_subject
from solver.simulate.trial import Scenario, simulate_trial

LATE_S = 0.025  # on three withheld blocks a few milliseconds drown in what no fit predicts
SETTINGS = Settings()
FEW = 0.02  # of the trial's frames


@dataclass(frozen=True)
class Case:
    fit: Fit
    balance: Balance

    def solved(self, candidate, eta=()) -> Solved:
        rung = self.balance.rungs[5]
        term = refined(self.balance, self.balance.term(candidate, eta), (), rung)
        return self.balance.solve_at([term], rung)

    @property
    def scene(self):
        return self.balance.scenes[0]


def case_of(folder, delay_s) -> Case:
    who, duration = Person(sex="female"), 2.3
    body_rng, motion_rng, noise_rng = np.random.default_rng(5).spawn(3)
    trial = simulate_trial(Scenario("walk", "walk", duration=duration), body_of(who, body_rng), motion_rng)
    plates = plates_under(trial.contacts, (0.0, duration))
    measured = measure(trial, plates, MARKERS, MeasurementSettings(force_delay_s=delay_s), noise_rng)
    write_subject(folder, who, [measured])
    alone = replace(SETTINGS, trajectory=replace(SETTINGS.trajectory, enabled=False))
    fit = solve(open_subject(folder), alone)
    return Case(fit, balance_of(fit, scenes_of(fit, SETTINGS, {}), SETTINGS.diagnosis))


@pytest.fixture(scope="module")
def late(tmp_path_factory) -> Case:
    return case_of(tmp_path_factory.mktemp("late"), LATE_S)


@pytest.fixture(scope="module")
def on_time(tmp_path_factory) -> Case:
    return case_of(tmp_path_factory.mktemp("on_time"), 0.0)


@pytest.fixture(scope="module")
def clock(late) -> Solved:
    return late.solved(ClockOffset("all"), (0.0,))


@pytest.fixture(scope="module")
def extension(late, clock):
    return extension_of(late.balance.scenes, clock)


@pytest.fixture(scope="module")
def gain(late, extension):
    return extended_fit(late.fit, extension, SETTINGS)


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def test_a_clocks_correction_gives_each_foot_what_it_had_on_time(late, on_time, extension):
    """Against the recording on time, foot by foot, where the same foot stands in both."""
    (extra,) = extension.trials.values()
    trial, right = late.fit.trials[0].contacts, on_time.fit.trials[0].contacts
    for foot, name in enumerate(trial.foot_bodies):
        (part,) = [p for p in extra.parts if p.body == name]
        inside = right.in_contact[:, foot] & trial.in_contact[:, foot] & extra.known
        error = (right.wrench_ground - trial.wrench_ground)[inside, foot, :3]
        left = error - part.at(extension.x)[inside, :3]
        assert rms(left) < 0.15 * rms(error)


def test_columns_of_eta_are_its_derivatives(late, clock, extension):
    """Against the signature 4 and 2 ms away: what is left is of second order."""
    (extra,) = extension.trials.values()
    (eta,), candidate = clock.eta(0)[0], ClockOffset("all")
    left = []
    for step in (0.004, 0.002):
        expected = candidate.signature(late.scene, (eta + step,)).fixed
        ahead = extra.fixed_ground + extra.columns_ground @ (extension.x + step)
        left.append(rms((expected - ahead)[extra.known]))
    at = extra.fixed_ground + extra.columns_ground @ extension.x
    same = candidate.signature(late.scene, (eta,)).fixed
    np.testing.assert_allclose(at[extra.known], same[extra.known], atol=1e-6)
    assert left[1] < 0.3 * left[0]


def test_causes_are_told_with_the_parameters_of_another_fit(late, clock, extension):
    (cause,) = causes_of(late.balance.scenes, clock, extension.x + 0.001)
    value, std = extension.causes[0].parameters["offset_s"]
    assert cause.parameters["offset_s"] == pytest.approx((value + 0.001, std))


def test_frames_beyond_the_clock_are_not_known(late, extension):
    (extra,) = extension.trials.values()
    assert extension.x[0] == pytest.approx(LATE_S, abs=0.003)
    assert 0 < (~extra.known).sum() < FEW * len(extra.known)
    assert not extra.known[-1]


def test_linear_columns_and_their_places(late):
    """A plate's gain acts on the foot that stands on it, a load on its segment."""
    for candidate in (PlateGain("plate_2"), CarriedMass("torso")):
        solved = late.solved(candidate)
        extension = extension_of(late.balance.scenes, solved)
        (extra,) = extension.trials.values()
        signature = candidate.signature(late.scene, ())
        np.testing.assert_allclose(extra.columns_ground, signature.columns, atol=1e-9)
        np.testing.assert_array_equal(extension.prior_std, signature.prior_std)
        assert extra.known.all()
        acts = {p.body for p in extra.parts if np.abs(p.columns_ground).max() > 0}
        if candidate.id == "carried_mass":
            assert acts == {"torso"}
        else:
            contacts = late.fit.trials[0].contacts
            owners = np.unique(contacts.plate[late.scene.plates[1].loaded, 1])
            assert acts - {None} <= {contacts.foot_bodies[i] for i in owners if i >= 0} | set(
                contacts.foot_bodies
            )
            part = next(p for p in extra.parts if p.body == contacts.foot_bodies[owners[0]])
            loaded = late.scene.plates[1].loaded
            np.testing.assert_allclose(part.columns_ground[loaded], signature.columns[loaded])


@pytest.fixture(scope="module")
def gain_on_time(on_time):
    solved = on_time.solved(ClockOffset("all"), (0.0,))
    return extended_fit(on_time.fit, extension_of(on_time.balance.scenes, solved), SETTINGS)


def test_the_fit_finds_the_clock(gain, gain_on_time):
    """Skin and tables' inertias give every recording some offset; the delay is the difference of two."""
    found = gain.fit.extra[0] - gain_on_time.fit.extra[0]
    assert found == pytest.approx(LATE_S, rel=0.1)


def test_what_was_withheld_is_predicted_better(gain):
    for figure, drop in (
        (gain.heldout_linear_residual_N, gain.heldout_linear_drop_N),
        (gain.heldout_angular_residual_Nm, gain.heldout_angular_drop_Nm),
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
    assert gain.heldout_linear_residual_N.before == pytest.approx(gain.heldout_linear_residual_N.after)
    assert gain.marker_rms_m.before == pytest.approx(gain.marker_rms_m.after)


def test_torques_move_to_those_of_the_recording_on_time(gain, gain_on_time):
    used = gain.after[0].used & gain_on_time.before[0].used
    right, wrong, mended = (
        dynamics[0].joint_torques[used, 6:] for dynamics in (gain_on_time.before, gain.before, gain.after)
    )
    assert rms(mended - right) < 0.5 * rms(wrong - right)


def test_the_json_part_is_plain_and_whole(gain):
    plain = json.loads(json.dumps(extended_gain_json(gain), allow_nan=False))
    assert {"before", "after", "interval"} == set(plain["heldout_linear_residual_N"])
    assert {"before", "after", "interval"} == set(plain["heldout_angular_residual_Nm"])
    assert {"before", "after"} == set(plain["marker_rms_m"]) == set(plain["mass_kg"])
    change = plain["joint_torque_change"]
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
    assert dof not in extended_gain_json(sliding)["joint_torque_change"]["most_changed"]


def test_courses_of_their_own_are_withheld_in_short_blocks(late):
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
    withheld = runs(_withheld(data, extra, SETTINGS))
    short = [end - start for start, end in withheld if start >= 200 and end <= 230]
    usual = [end - start for start, end in withheld if end <= 200]
    assert short and set(short) == {round(SUB_BLOCK_S * rate)}  # noqa: PT018 some, and all of that length
    assert set(usual) == {round(SETTINGS.trajectory.heldout_block_s * rate)}


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
    two, drop = _heldout([(0, 30, 50), (0, 90, 110)], before, after, slice(0, 3))
    frames = [*range(30, 50), *range(90, 110)]
    expected = np.sqrt((gain.after[0].residual_root[frames, :3] ** 2).sum(axis=1).mean())
    assert two.after == pytest.approx(expected)
    assert two.interval is None
    assert drop is None
    nothing, drop = _heldout([], before, after, slice(0, 3))
    plain = extended_gain_json(replace(gain, heldout_linear_residual_N=nothing, heldout_linear_drop_N=drop))
    assert plain["heldout_linear_residual_N"] == {"before": None, "after": None}
    json.dumps(plain, allow_nan=False)
