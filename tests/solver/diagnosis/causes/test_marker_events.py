"""Of markers that seem to slip at one instant: distances within the segment tell which one did, if any."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.faults.editor.edits import carried_by_cloth, part, slipped
from benchmarks.faults.editor.recording import write_folder
from benchmarks.faults.editor.sources import SOURCES
from solver.capture.subject.opened_subject import open_subject
from solver.common.progress import silent
from solver.diagnosis.causes.marker_events import UNDECIDED_GAIN, events_of, segment_distances
from solver.diagnosis.causes.marker_slip import findings
from solver.diagnosis.diagnose_subject import repaired_balance
from solver.fitting.settings import settings_for

SLIP_M = np.array([0.0, 0.012, -0.009])
FRAME = 180


def moved(scene, names, shift_body=SLIP_M, frame=FRAME):
    """Markers carried along their segment's axes from a frame on; the pose stays."""
    observed = scene.markers.observed_ground.copy()
    for name in names:
        m = scene.markers.names.index(name)
        observed[frame:, m] += scene.R_ground_body[frame:, scene.markers.body[m]] @ shift_body
    return replace(scene, markers=replace(scene.markers, observed_ground=observed))


def of_torso(scene):
    body = scene.skeleton.body_index("torso")
    return [n for n, b in zip(scene.markers.names, scene.markers.body, strict=True) if b == body]


def test_distances_single_out_the_marker_that_moved(sound):
    name = of_torso(sound)[0]
    m = sound.markers.names.index(name)
    asked = segment_distances(moved(sound, [name]), m, FRAME, SLIP_M)
    assert asked.likeliest == m
    others = asked.gains[asked.markers != m]
    assert asked.gain(m) > 6.0 + others.max()
    assert asked.predicted > 6.0


def test_a_segment_whose_markers_all_move_shows_no_slip(sound):
    names = of_torso(sound)
    assert len(names) >= 3
    m = sound.markers.names.index(names[0])
    asked = segment_distances(moved(sound, names), m, FRAME, SLIP_M)
    assert asked.gains.max() < 3.0
    assert asked.predicted > 6.0  # of one alone they would have shown it


def test_a_slip_that_an_earlier_fit_showed_is_known_though_fewer_markers_are_left(sound):
    """A repair may leave the next fit fewer markers: places in the former one's list mean nothing there."""
    name = of_torso(sound)[0]
    scene = moved(sound, [name])
    (slip, *_) = (found for found in findings(scene) if found.target == name)
    before = replace(slip, marker=len(scene.markers.names) + 3)
    assert events_of(scene, [slip]).slips
    assert events_of(scene, [slip], [before]).slips == ()


def test_nothing_happens_where_nothing_moved(sound):
    m = sound.markers.names.index(of_torso(sound)[0])
    assert segment_distances(sound, m, FRAME, SLIP_M).gains.max() < 3.0


def test_how_far_the_others_move_against_one_another_is_no_matter_of_the_marker_itself(sound):
    name = of_torso(sound)[0]
    m = sound.markers.names.index(name)
    asked = segment_distances(sound, m, FRAME, SLIP_M)
    still, other = asked.among_others_m, sound.markers.names[asked.markers[asked.markers != m][0]]
    assert segment_distances(moved(sound, [name], 3 * SLIP_M), m, FRAME, SLIP_M).among_others_m == still
    raised = [
        segment_distances(moved(sound, [other], 0.04 * axis), m, FRAME, SLIP_M).among_others_m
        for axis in np.eye(3)
    ]
    assert max(raised) > still + 0.01


def test_a_jump_that_distances_deny_is_a_note_and_no_slip(sound, long_walk, tracked):
    """The pose's own word, on markers that kept their distances."""
    observed, skeleton = long_walk
    m = skeleton.marker_names.index("C7")
    altered = observed.copy()
    altered[FRAME:, m] += sound.R_ground_body[FRAME:, sound.markers.body[m]] @ SLIP_M
    jumping = tracked(altered, skeleton)
    jumps = findings(jumping)
    assert [s.target for s in events_of(jumping, jumps).slips] == ["C7"]
    denied = events_of(sound, jumps)
    assert denied.slips == ()
    (note,) = denied.notes
    assert "C7" in note
    assert "no marker is named" in note


def seen_in(real_data, tmp_path, name, edit=None, seed=0):
    recording = next(s for s in SOURCES if s.name == name).read(real_data)
    fault = None
    if edit is not None:
        recording, fault = edit(recording, np.random.default_rng(seed))
    write_folder(tmp_path, recording)
    _, seen, _ = repaired_balance(
        open_subject(tmp_path), settings_for(tmp_path), trials=None, reviews={}, progress=silent
    )
    return seen, fault


def test_a_drop_jump_names_no_marker(real_data, tmp_path):
    """Trunk and shoulders are no rigid bodies: nine slips were named here, most of them very sure."""
    seen, _ = seen_in(real_data, tmp_path, "drop jump F")
    assert [f.target for f in seen.findings if f.id == "marker_slip"] == []
    assert any("no marker is named" in note for note in seen.notes)


def test_shoulders_that_the_arms_raise_make_no_slip_of_the_neck(real_data, tmp_path):
    """From 7 to 90 % of the trial it is C7 alone that seems to slip, by 14 mm; the shoulders move by 70."""
    seen, _ = seen_in(real_data, tmp_path, "drop jump F", part(0.07, 0.9))
    assert [f for f in seen.findings if f.id == "marker_slip"] == []


@pytest.mark.slow
def test_a_slip_in_a_drop_jump_is_the_only_one_named(real_data, tmp_path):
    seen, fault = seen_in(real_data, tmp_path, "drop jump F", slipped(0.03), seed=2)
    assert tuple(f.target for f in seen.findings if f.id == "marker_slip") == fault.markers


def slowly(edit, seconds=0.15):
    """The same in the time history of some frames: no path is cut."""

    def slow(recording, rng):
        edited, fault = edit(recording, rng)
        before, after = recording.trials[0], edited.trials[0]
        share = np.clip((before.times - fault.times_s[0]) / seconds, 0.0, 1.0)[:, None, None]
        positions = before.positions + share * (after.positions - before.positions)
        return edited.with_trial(0, replace(after, positions=positions)), fault

    return slow


def test_where_cloth_slides_slowly_no_slip_is_very_sure(real_data, tmp_path):
    """Four of five markers of an arm move together, and the fifth seems to slip against them."""
    seen, _ = seen_in(real_data, tmp_path, "treadmill run C", slowly(carried_by_cloth(0.03)), seed=5)
    assert all(f.gain <= UNDECIDED_GAIN for f in seen.findings if f.id == "marker_slip")
