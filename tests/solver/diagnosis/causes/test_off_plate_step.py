"""A foot that stands where no plate measures it: where that is looked for, and what is told."""

from dataclasses import replace

import numpy as np
import pytest

from solver.common.true_runs import runs
from solver.contact.detected_ranges import (
    CONTACT_BUT_NO_FORCE,
    FORCE_DISCREPANCY,
    NOT_OVER_FORCE_PLATE,
    Proposal,
)
from solver.diagnosis.causes.effect import Fitted, Range
from solver.diagnosis.causes.observed_trial import force_at
from solver.diagnosis.causes.off_plate_step import (
    OffPlateStep,
    missing_force,
    off_plate_stances,
    shortest_stance_s,
    sole_line,
)
from solver.diagnosis.diagnose_subject import steps_not_named
from solver.diagnosis.diagnosis_report import cause_of
from solver.simulate.demo_subject import MARKERS
from solver.simulate.laboratory import MeasurementSettings, measure, plates_under, stances_within


def silenced(scene, frames):
    """The recording without the right foot's force on some frames, and the foot as if in the air."""
    column = scene.contacts.foot_bodies.index("calcn_r")
    lost = np.zeros(scene.frames, dtype=bool)
    lost[slice(*frames)] = True
    wrench = scene.contacts.wrench_ground[:, column] * lost[:, None]
    plates = (
        replace(scene.plates[0], wrench_ground=scene.plates[0].wrench_ground - wrench),
        *scene.plates[1:],
    )
    in_contact = scene.contacts.in_contact.copy()
    in_contact[lost, column] = False
    return replace(scene, plates=plates, contacts=replace(scene.contacts, in_contact=in_contact))


def a_whole_stance(scene):
    inner = [r for r in runs(scene.contacts.in_contact[:, 0]) if r[0] > 0 and r[1] < scene.frames]
    return max(inner, key=lambda r: r[1] - r[0])


def test_missing_force_is_the_deficit(scene, recorded):
    push = force_at(np.tile([0.0, 50.0, 0.0], (scene.frames, 1)), scene.com_ground)
    assert np.allclose(missing_force(recorded(scene.required_ground - push)), 50.0, atol=0.1)


def test_where_nothing_was_recorded_no_force_is_missing(scene):
    """Neither there nor on the frames beside it."""
    start, end = a_whole_stance(scene)
    counts = scene.counts.copy()
    counts[start:end] = False
    lost = replace(silenced(scene, (start, end)), counts=counts)
    assert np.abs(missing_force(lost) - missing_force(scene))[~counts].max() < 0.1 * scene.weight_N
    assert np.abs(missing_force(lost) - missing_force(scene))[counts].max() < 0.02 * scene.weight_N
    assert off_plate_stances([lost]) == []
    assert not missing_force(replace(lost, counts=np.zeros_like(counts))).any()


def test_a_silent_plate_under_a_standing_foot_is_gross(scene):
    start, end = a_whole_stance(scene)
    (found,) = off_plate_stances([silenced(scene, (start, end))])
    assert found.foot_body == "calcn_r"
    assert found.gross
    assert found.load_N == scene.weight_N
    assert abs(found.stretch.start - start) <= 8
    assert abs(found.stretch.end - end) <= 8


def test_a_runner_s_ground_may_carry_more_than_a_walker_s(scene):
    silent = silenced(scene, a_whole_stance(scene))
    harder = replace(silent, required_ground=2.5 * silent.required_ground)
    lacking = missing_force(harder).max()
    assert any(scene.weight_N < s.load_N < lacking for s in off_plate_stances([harder]))


def test_a_step_is_seen_although_the_foot_seems_to_stand_for_much_longer(scene):
    start, end = a_whole_stance(scene)
    lighter = scene.required_ground - force_at(np.array([0.0, 20.0, 0.0]), scene.com_ground)
    silent = silenced(replace(scene, required_ground=lighter), (start, end))
    too_long = Proposal((start, scene.frames), "calcn_r", CONTACT_BUT_NO_FORCE, 0.6)
    sure = Proposal((start, end), "calcn_r", NOT_OVER_FORCE_PLATE, 0.98)
    assert off_plate_stances([replace(silent, proposals=(too_long,))]) == []
    (found,) = off_plate_stances([replace(silent, proposals=(too_long, sure))])
    assert abs(found.stretch.end - end) <= 8


def test_a_step_goes_no_further_than_the_recording(scene):
    start, end = a_whole_stance(scene)
    middle = (start + end) // 2
    recorded = scene.counts & (np.arange(scene.frames) < middle)
    sure = Proposal((start, end), "calcn_r", NOT_OVER_FORCE_PLATE, 0.98)
    silent = replace(silenced(scene, (start, end)), counts=recorded, proposals=(sure,))
    (found,) = off_plate_stances([silent])
    assert middle <= found.stretch.end <= middle + 8


def test_a_step_that_detection_is_sure_of_gets_a_word_where_no_cause_names_it(scene):
    seen = replace(scene, proposals=(Proposal((40, 100), "calcn_r", NOT_OVER_FORCE_PLATE, 0.98),))
    (note,) = steps_not_named([seen], ())
    assert "calcn_r stand on no plate in frames 40 to 99 (98 % sure)" in note
    named = cause_of(OffPlateStep.about, "calcn_l+calcn_r", {}, 1.0, [Range(scene.name, 90, 120)])
    assert list(steps_not_named([seen], [named])) == []
    others = replace(named, target="calcn_l"), replace(named, frames=((scene.name, 100, 120),))
    assert all(list(steps_not_named([seen], [other])) == [note] for other in others)
    assert list(steps_not_named([replace(seen, counts=np.zeros(scene.frames, dtype=bool))], ())) == []


def test_the_subjects_settings_say_how_a_foot_stands(scene):
    silent = silenced(scene, a_whole_stance(scene))
    never = replace(silent.contact_settings, touch_height_m=0.0, touch_speed_m_s=0.0)
    assert off_plate_stances([silent]) != []
    assert off_plate_stances([replace(silent, contact_settings=never)]) == []


def test_a_deficit_that_is_short_for_a_stance_is_none(scene):
    start, _ = a_whole_stance(scene)
    assert off_plate_stances([silenced(scene, (start + 20, start + 32))]) == []


def test_what_the_detection_proposes_on_a_measured_foot_is_not_gross(scene):
    start, end = a_whole_stance(scene)
    half = replace(scene, plates=tuple(replace(p, wrench_ground=0.6 * p.wrench_ground) for p in scene.plates))
    proposal = Proposal((start, end), "calcn_r", CONTACT_BUT_NO_FORCE, 0.9)
    found = off_plate_stances([replace(half, proposals=(proposal,))])
    assert any(s.foot_body == "calcn_r" for s in found)
    assert not any(s.gross for s in found)


def test_shortest_stance_scales_with_those_measured(scene):
    start, end = a_whole_stance(scene)
    assert 0.2 * (end - start) / 100 < shortest_stance_s([scene]) < 0.6 * (end - start) / 100


MISSED = 2


@pytest.fixture(scope="module")
def missed(walk):
    """Foot, first and last time [s] of the stance without a plate."""
    stance = stances_within(walk.contacts, (0.0, walk.scenario.duration))[MISSED]
    return ("calcn_r", "calcn_l")[stance.foot], stance.start, stance.end


@pytest.fixture(scope="module")
def partial(walk, seen_of):
    plates = plates_under(walk.contacts, (0.0, walk.scenario.duration), missed=(MISSED,))
    return seen_of(walk, measure(walk, plates, MARKERS, MeasurementSettings(), np.random.default_rng(3)))


def test_the_foot_is_found_and_when_it_stands(partial, missed):
    foot, start, end = missed
    (candidate,) = OffPlateStep.candidates([partial])
    assert candidate.target == foot
    stance = candidate.stances[0].stretch
    assert len(candidate.stances) == 1
    assert abs(stance.start / 100 - start) < 0.09
    assert abs(stance.end / 100 - end) < 0.09


def test_signature_holds_the_step(partial, scene, missed, fitted, walk):
    """The force that no plate measured, from the simulator: nothing else is missing."""
    (candidate,) = OffPlateStep.candidates([partial])
    foot = ("calcn_r", "calcn_l").index(missed[0])
    missing = walk.reactions(scene.times).wrench_ground[:, foot].copy()
    missing[(scene.times < missed[1]) | (scene.times > missed[2])] = 0.0
    x, covariance = fitted(candidate, partial, missing)
    left = missing - candidate.signature(partial, ()).columns @ x
    left[:, 3:] -= np.cross(scene.com_ground, left[:, :3])
    assert np.sqrt((left[:, 1] ** 2).mean()) < 0.05 * np.sqrt((missing[:, 1] ** 2).mean())
    assert np.sqrt((left[:, 3:] ** 2).mean()) < 0.01 * scene.weight_N  # a lever of a centimetre
    found = candidate.estimates([partial], Fitted((), (), x, covariance))
    stance = candidate.stances[0].stretch
    assert found["force_y_N"].value == pytest.approx(missing[stance.start : stance.end, 1].mean(), rel=0.02)
    assert found["pressing_share"].value > 0.9
    assert candidate.is_notable(found)
    (stood,) = candidate.frames([partial], (), x)
    assert stood.trial == "walk"
    assert abs(stood.start / 100 - missed[1]) < 0.03
    assert abs(stood.end / 100 - missed[2]) < 0.03


def test_feet_that_step_beside_in_turn_are_also_tried_together(walk, seen_of):
    plates = plates_under(walk.contacts, (0.0, walk.scenario.duration), missed=(MISSED, MISSED + 1))
    scene = seen_of(walk, measure(walk, plates, MARKERS, MeasurementSettings(), np.random.default_rng(3)))
    made = OffPlateStep.candidates([scene])
    assert {c.target for c in made[:2]} == {"calcn_r", "calcn_l"}
    assert set(made[2].target.split("+")) == {"calcn_r", "calcn_l"}
    widths = [c.signature(scene, ()).columns.shape[2] for c in made]
    assert widths[2] == sum(widths[:2])


def test_a_pull_is_no_step(partial, fitted):
    (candidate,) = OffPlateStep.candidates([partial])
    missing = np.zeros((partial.frames, 6))
    missing[:, 1] = -300.0
    x, covariance = fitted(candidate, partial, missing)
    assert not candidate.is_notable(candidate.estimates([partial], Fitted((), (), x, covariance)))
    assert candidate.frames([partial], (), x) == ()


def test_nothing_is_suspected_where_all_is_measured(scene):
    assert OffPlateStep.candidates([scene]) == []


def test_a_proposal_is_not_believed_where_the_balance_closes(scene):
    proposal = Proposal((40, 100), "calcn_r", CONTACT_BUT_NO_FORCE, 0.9)
    assert OffPlateStep.candidates([replace(scene, proposals=(proposal,))]) == []


def test_sole_line_runs_from_heel_to_toes(scene):
    heel, tip, left = sole_line(scene, "calcn_r")
    level = tip - heel
    assert np.abs(level[:, 1]).max() < 1e-12
    standing = scene.contacts.in_contact[:, 0]
    assert 0.2 < np.linalg.norm(level[standing], axis=1).mean() < 0.3
    assert np.abs((left * level).sum(axis=1)).max() < 1e-12
    forward = scene.com_ground[-1] - scene.com_ground[0]
    assert (level[standing] @ forward > 0).all()


def test_stances_that_lack_all_are_also_tried_without_those_that_lack_some(walk, seen_of):
    """Somebody held up by a quarter of body weight: every stance lacks that, one lacks all."""
    plates = plates_under(walk.contacts, (0.0, walk.scenario.duration), missed=(MISSED,))
    scene = seen_of(walk, measure(walk, plates, MARKERS, MeasurementSettings(), np.random.default_rng(3)))
    carried = [replace(plate, wrench_ground=0.75 * plate.wrench_ground) for plate in scene.plates]
    proposals = tuple(
        Proposal((start, end), scene.contacts.foot_bodies[foot], FORCE_DISCREPANCY, 0.9)
        for foot in range(2)
        for start, end in runs(scene.contacts.in_contact[:, foot])
    )
    held_up = replace(scene, plates=tuple(carried), proposals=proposals)
    foot = next(c.target for c in OffPlateStep.candidates([scene]))
    counts = [len(c.stances) for c in OffPlateStep.candidates([held_up]) if c.target == foot]
    assert len(counts) == 2
    assert counts[1] == 1 < counts[0]


def test_its_size_is_the_mean_of_the_vertical_force_while_it_stands(walk, seen_of):
    plates = plates_under(walk.contacts, (0.0, walk.scenario.duration), missed=(MISSED, MISSED + 1))
    scene = seen_of(walk, measure(walk, plates, MARKERS, MeasurementSettings(), np.random.default_rng(3)))
    both = OffPlateStep.candidates([scene])[2]
    columns = both.signature(scene, ()).columns
    x = np.random.default_rng(6).normal(size=columns.shape[2])
    covariance = np.diag(np.arange(1.0, len(x) + 1))
    standing = np.zeros(scene.frames, dtype=bool)
    for stance in both.stances:
        standing[stance.stretch.start : stance.stretch.end] = True
    time_history = columns[standing, 1].mean(axis=0)
    found = both.estimates([scene], Fitted((), (), x, covariance))["force_y_N"]
    assert found.value == pytest.approx(time_history @ x, rel=1e-9)
    assert found.std == pytest.approx(np.sqrt(time_history @ covariance @ time_history), rel=1e-9)
