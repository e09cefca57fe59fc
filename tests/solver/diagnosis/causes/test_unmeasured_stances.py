from dataclasses import replace

import numpy as np

from solver.common.runs import runs
from solver.contact.proposals import CONTACT_BUT_NO_FORCE, Proposal
from solver.diagnosis.causes.off_plate_step import missing_force, shortest_stance_s, unmeasured_stances
from solver.diagnosis.causes.scene import force_at


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
    assert unmeasured_stances([lost]) == []
    assert not missing_force(replace(lost, counts=np.zeros_like(counts))).any()


def test_a_silent_plate_under_a_standing_foot_is_gross(scene):
    start, end = a_whole_stance(scene)
    (found,) = unmeasured_stances([silenced(scene, (start, end))])
    assert found.foot_body == "calcn_r"
    assert found.gross
    assert abs(found.stretch.start - start) <= 8
    assert abs(found.stretch.end - end) <= 8


def test_the_subjects_settings_say_how_a_foot_stands(scene):
    silent = silenced(scene, a_whole_stance(scene))
    never = replace(silent.contact_settings, touch_height_m=0.0, touch_speed_m_s=0.0)
    assert unmeasured_stances([silent]) != []
    assert unmeasured_stances([replace(silent, contact_settings=never)]) == []


def test_a_deficit_that_is_short_for_a_stance_is_none(scene):
    start, _ = a_whole_stance(scene)
    assert unmeasured_stances([silenced(scene, (start + 20, start + 32))]) == []


def test_what_the_detection_proposes_on_a_measured_foot_is_not_gross(scene):
    start, end = a_whole_stance(scene)
    half = replace(scene, plates=tuple(replace(p, wrench_ground=0.6 * p.wrench_ground) for p in scene.plates))
    proposal = Proposal((start, end), "calcn_r", CONTACT_BUT_NO_FORCE, 0.9)
    found = unmeasured_stances([replace(half, proposals=(proposal,))])
    assert any(s.foot_body == "calcn_r" for s in found)
    assert not any(s.gross for s in found)


def test_shortest_stance_scales_with_those_measured(scene):
    start, end = a_whole_stance(scene)
    assert 0.2 * (end - start) / 100 < shortest_stance_s([scene]) < 0.6 * (end - start) / 100
