"""The residual's description against plain statements about the walk that it is of."""

from dataclasses import replace

import numpy as np
import pytest

from solver.contact.wrenches import TWO_FEET
from solver.diagnosis.causes.plate_readings import PlateGain
from solver.diagnosis.residual_description import WORST_S, describe_residual
from solver.diagnosis.search.balance import Balance, laboratory_errors
from solver.fitting.diagnosis_settings import DiagnosisSettings
from tests.solver.diagnosis.conftest import trial_rows_of, with_demand

PULL_N = 200.0


@pytest.fixture
def pulled(short_scene):
    """The walk's balance closed, but for 200 N forward at the centre of mass on some frames."""

    def made(frames, scene=short_scene):
        missing = np.zeros((scene.frames, 6))
        missing[frames, 0] = PULL_N
        missing[:, 3:] = np.cross(scene.com_ground, missing[:, :3])
        return with_demand(scene, scene.measured_ground + missing)

    return made


def description(*scenes):
    balance = Balance([trial_rows_of(scene) for scene in scenes], DiagnosisSettings())
    return describe_residual(balance, balance.solve([]))


def test_sizes_are_root_mean_squares_of_window_means_about_the_centre_of_mass(drawn):
    scene = drawn(3)
    lacking = scene.required_ground - scene.measured_ground
    lacking[:, 3:] -= np.cross(scene.com_ground, lacking[:, :3])
    windows = trial_rows_of(scene).windows
    means = np.array([windows.weights @ lacking[s : s + windows.length] for s in windows.start])
    whole = description(scene)
    assert whole.force_N == pytest.approx(np.sqrt((means[:, :3] ** 2).sum(axis=1).mean()))
    assert whole.moment_Nm == pytest.approx(np.sqrt((means[:, 3:] ** 2).sum(axis=1).mean()))
    assert whole.seconds == pytest.approx(windows.count * np.diff(windows.start).min() / scene.rate)


def test_the_noise_floor_is_that_of_the_typical_model_error(short_scene):
    rows = trial_rows_of(short_scene)
    plates = laboratory_errors([rows])
    shared = np.concatenate([rows.nuisance, rows.tissue, plates], axis=1)
    K = shared @ shared.T + rows.covariance + rows.model_error
    variance = np.diag(K).reshape(-1, 6)
    whole = description(short_scene)
    assert whole.force_floor_N == pytest.approx(np.sqrt(variance[:, :3].sum(axis=1).mean()))
    assert whole.moment_floor_Nm == pytest.approx(np.sqrt(variance[:, 3:].sum(axis=1).mean()))


def test_sound_recordings_lie_about_the_noise_floor(drawn):
    """The draws have plates' noise and model errors, not other inertias: a little less than the floor."""
    ratios = []
    for seed in range(12):
        whole = description(drawn(seed))
        ratios.append((whole.force_N / whole.force_floor_N, whole.moment_Nm / whole.moment_floor_Nm))
    assert np.all((np.mean(ratios, axis=0) > 0.5) & (np.mean(ratios, axis=0) < 1.2))


def test_what_happens_under_one_foot_is_told_of_that_phase(short_scene, pulled):
    right = short_scene.contacts.foot_bodies.index("calcn_r")
    alone = short_scene.contacts.in_contact[:, right] & (short_scene.contacts.in_contact.sum(axis=1) == 1)
    found = description(pulled(alone))
    by_foot = {p.foot: p for p in found.phases if p.phase == "single_support"}
    assert set(by_foot) == {"calcn_r", "calcn_l"}
    assert by_foot["calcn_r"].force_N > 0.9 * PULL_N
    assert by_foot["calcn_l"].force_N < 0.1 * PULL_N
    assert sum(p.seconds for p in found.phases) == pytest.approx(found.seconds)
    assert {"double_support"} <= {p.phase for p in found.phases}


def test_two_feet_on_one_plate_are_both_and_a_load_without_a_foot_is_none(short_scene):
    contacts = short_scene.contacts
    nobody = replace(contacts, in_contact=np.zeros_like(contacts.in_contact))
    shared = replace(nobody, plate=np.full_like(contacts.plate, TWO_FEET))
    unloaded = tuple(replace(p, loaded=np.zeros_like(p.loaded)) for p in short_scene.plates)
    for scene, phase in (
        (replace(short_scene, contacts=shared), "double_support"),
        (replace(short_scene, contacts=nobody), "load_on_no_foot"),
        (replace(short_scene, contacts=shared, plates=unloaded), "no_load"),
    ):
        longest = description(scene).phases[0]
        assert (longest.phase, longest.foot) == (phase, None)


def test_toes_go_with_their_foot(short_scene):
    contacts = short_scene.contacts
    names = tuple(name.replace("calcn_r", "toes_r") for name in contacts.foot_bodies)
    on_toes = replace(short_scene, contacts=replace(contacts, foot_bodies=names))
    feet = [p.foot for p in description(on_toes).phases]
    assert feet == [p.foot for p in description(short_scene).phases]


def test_the_worst_half_second_is_found_in_each_trial(short_scene, pulled):
    early, late = pulled(slice(20, 60)), pulled(slice(90, 130))
    found = description(replace(early, name="early"), replace(late, name="late"))
    for trial, (start, end) in zip(found.trials, ((20, 60), (90, 130)), strict=True):
        first, last = trial.worst.frames
        assert (last - first) / short_scene.rate == pytest.approx(WORST_S, abs=0.04)
        assert first <= start
        assert last >= end
        frame = np.array(trial.time_history.time_s) * short_scene.rate
        inside = np.array(trial.time_history.force_N)[(frame > first) & (frame < last)]
        assert trial.worst.force_N == pytest.approx(np.sqrt(np.mean(inside**2)))
        assert trial.worst.force_N > trial.force_N


def test_directions_are_named_as_the_walk_goes(short_scene, pulled):
    found = description(pulled(slice(0, None)))
    x, y, z = found.axes
    assert (x.direction, y.direction, z.direction) == ("forward", "vertical", "sideways")  # 20° beside x
    assert (x.mean_force_N, x.force_N) == pytest.approx((PULL_N, PULL_N))
    assert (y.force_N, z.force_N) == pytest.approx((0, 0), abs=1e-9)
    foot = short_scene.p_ground_body[:, short_scene.skeleton.body_index("calcn_r")]
    still = replace(short_scene, com_ground=foot, contacts=_on_right_foot(short_scene))
    assert [a.direction for a in description(still).axes] == [None, "vertical", None]
    other = replace(short_scene, name="back", com_ground=short_scene.com_ground[:, [2, 1, 0]])
    assert [a.direction for a in description(short_scene, other).axes] == [None, "vertical", None]


def _on_right_foot(scene):
    on_foot = np.zeros_like(scene.contacts.in_contact)
    on_foot[:, scene.contacts.foot_bodies.index("calcn_r")] = True
    return replace(scene.contacts, in_contact=on_foot)


def test_the_time_history_after_is_what_the_causes_leave(short_scene, drawn):
    scene = drawn(4, 0.15 * short_scene.plates[1].wrench_ground)
    balance = Balance([trial_rows_of(scene)], DiagnosisSettings())
    solved = balance.solve([balance.term(PlateGain("plate_2"), ())])
    (trial,) = describe_residual(balance, solved).trials
    left = (balance.residual - solved.terms[0].columns @ solved.x).reshape(-1, 6)
    np.testing.assert_allclose(trial.time_history.force_after_N, np.linalg.norm(left[:, :3], axis=1))
    np.testing.assert_allclose(trial.time_history.moment_after_Nm, np.linalg.norm(left[:, 3:], axis=1))
    assert np.mean(trial.time_history.force_after_N) < np.mean(trial.time_history.force_N)


def test_what_reading_undid_is_described_as_if_it_had_not(short_scene):
    balance = Balance([trial_rows_of(short_scene)], DiagnosisSettings())
    term = balance.term(PlateGain("plate_2"), ())
    undone = replace_fixed(term, 0.2 * term.columns[:, 0])
    found = describe_residual(balance, balance.solve([]), [undone])
    forces = (balance.residual - 0.2 * term.columns[:, 0]).reshape(-1, 6)[:, :3]
    assert found.force_N == pytest.approx(np.sqrt((forces**2).sum(axis=1).mean()))


def replace_fixed(term, fixed):
    return replace(term, fixed=fixed, columns=np.zeros((len(fixed), 0)), same=object())
