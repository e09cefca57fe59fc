"""`trialRanges` of a synthetic _subject.json: which frames they leave, and how a slip is named."""

import json

import numpy as np
import pytest

from solver.capture.capture import Markers, TrialFiles
from solver.capture.formats.trc import write_trc
from solver.capture.subject.description import read_json
from solver.capture.subject.subject import open_subject
from solver.capture.subject.trial_ranges import outside_ranges, trial_ranges, with_ranges
from solver.capture.trial import read_trial
from solver.common.errors import CaptureError


def markers(frames=200, rate=100.0, start=0.5):
    rng = np.random.default_rng(1)
    standing = rng.uniform(0, 1, (1, 4, 3)) + 0.001 * rng.standard_normal((frames, 4, 3))
    return Markers(("C7", "LASI", "LHEE", "LTOE"), standing, rate, start)


def said(tmp_path, ranges):
    path = tmp_path / "_subject.json"
    path.write_text(json.dumps({"massKg": 70, "trialRanges": ranges}), encoding="utf-8")
    return trial_ranges(read_json(path))


def test_a_trial_has_a_pair_of_times_or_several(tmp_path):
    ranges = said(tmp_path, {"walk": [0.45, 2], "run": [[0, 1], [1.5, 2.5]], "jump": []})
    assert ranges == {"walk": ((0.45, 2.0),), "run": ((0.0, 1.0), (1.5, 2.5)), "jump": ()}


@pytest.mark.parametrize("ranges", [None, {}, []])
def test_nothing_said(tmp_path, ranges):
    assert said(tmp_path, ranges) is None


@pytest.mark.parametrize(
    ("ranges", "complaint"),
    [
        ([0.4, 2.0], "ranges belong to trials"),
        ({"walk": 0.4}, r"trialRanges\.walk = 0\.4: two times in seconds"),
        ({"walk": [0.4, 2.0, 3.0]}, "two times in seconds"),
        ({"walk": ["0.4", "2"]}, "two times in seconds"),
        ({"walk": [[0.4, 2.0], 3.0]}, "two times in seconds"),
        ({"walk": [True, 2]}, "two times in seconds"),
        ({"walk": [2.0, 0.4]}, "must end after it begins"),
    ],
)
def test_a_slip_is_named_with_the_file(tmp_path, ranges, complaint):
    with pytest.raises(CaptureError, match=f"_subject.json: .*{complaint}"):
        said(tmp_path, ranges)


def test_a_range_holds_both_its_ends(tmp_path):
    outside, notes = outside_ranges(((0.8, 1.0), (1.5, 9.0)), markers())
    assert np.flatnonzero(~outside).tolist() == [*range(30, 51), *range(100, 200)]
    assert notes == (
        "forces of frames 0 to 29, 51 to 99 are not used: outside trialRanges (0.8 to 1 s, 1.5 to 9 s)",
    )


def test_rounded_times_still_find_their_frame():
    outside, _ = outside_ranges(((0.017, 0.05),), markers(frames=10, rate=60.0, start=0.0))
    assert np.flatnonzero(~outside).tolist() == [1, 2, 3]


def test_a_range_over_the_whole_trial_leaves_nothing_out():
    outside, notes = outside_ranges(((0.0, 10.0),), markers())
    assert not outside.any()
    assert notes == ()


def test_without_ranges_there_is_nothing_to_say():
    assert outside_ranges((), markers()) == (None, ())


def test_a_range_beside_the_trial_is_noted_with_the_corrected_by():
    outside, (note,) = outside_ranges(((10.0, 12.0),), markers())
    assert outside.all()
    assert "hold no frame of the trial (0.5 to 2.49 s)" in note
    assert "_subject.json" in note


def test_a_range_of_no_trial_is_noted(tmp_path):
    trials, notes = with_ranges([TrialFiles("walk", tmp_path / "a.trc")], {"wlak": ((0.0, 1.0),)})
    assert trials[0].ranges == ()
    assert "no trial is called wlak" in notes[0]


def test_a_trial_is_read_whole_and_says_what_is_not_used(tmp_path):
    said(tmp_path, {"walk": [0.8, 1.0]})
    place = tmp_path / "trials" / "walk"
    place.mkdir(parents=True)
    write_trc(place / "markers.trc", markers())
    (trial,) = open_subject(tmp_path).trials
    assert trial.ranges == ((0.8, 1.0),)
    capture = read_trial(trial)
    assert capture.markers.frames == 200
    assert np.flatnonzero(~capture.outside_ranges).tolist() == list(range(30, 51))
    assert any("frames 0 to 29, 51 to 199 are not used" in note for note in capture.notes)
