import json

import numpy as np
import pytest

from solver.capture.capture import Markers, TrialFiles
from solver.capture.formats.trc import write_trc
from solver.capture.subject.description import read_json
from solver.capture.subject.opened_subject import open_subject
from solver.capture.subject.review import imported_review, outside_ranges, trial_ranges, with_ranges
from solver.capture.trial import read_trial
from solver.common.errors import CaptureError


def markers(frames=20, rate=100.0, start=0.5):
    return Markers(("A",), np.zeros((frames, 1, 3)), rate, start)


def segment(folder, number, labels, times=None, *, finished=True, header="timestamp,knee"):
    place = folder / f"segment_{number}"
    place.mkdir()
    if labels is not None:
        (place / "review.json").write_text(json.dumps({"missing_grf_data": labels}))
    if times is not None:
        (place / "data.csv").write_text("\n".join([header, *(f"{time},0" for time in times)]))
    if finished:
        (place / "REVIEWED").write_text("")
    return place / "review.json"


def test_no_review():
    assert imported_review((), markers()) == (None, None, ())


def test_segments_follow_one_another_without_timestamps(tmp_path):
    reviews = [
        segment(tmp_path, 1, [True] * 5 + [False] * 5),
        segment(tmp_path, 2, [False] * 4 + [True] * 6, range(10), header="Header A,Header B"),
    ]
    mask, reviewed, notes = imported_review(reviews, markers())
    assert np.flatnonzero(mask).tolist() == [0, 1, 2, 3, 4, 14, 15, 16, 17, 18, 19]
    assert (reviewed, notes) == (None, ())


def test_timestamps_place_a_segment(tmp_path):
    reviews = [
        segment(tmp_path, 1, [True, True, False], [0.52, 0.53, 0.54]),
        segment(tmp_path, 2, [False, True], [0.6, 0.61]),
    ]
    mask, reviewed, notes = imported_review(reviews, markers())
    assert np.flatnonzero(mask).tolist() == [2, 3, 11]
    assert "15 frames have no review: detection decides" in notes[0]
    assert np.flatnonzero(reviewed).tolist() == [2, 3, 4, 10, 11]


@pytest.mark.parametrize(
    "times", [[0.5, 0.5, 0.5], [0.5, 0.51, 0.52], [0.6, 0.55, 0.5], ["a", "b", "c"], [9.0, 9.01, 9.02], [0.5]]
)
def test_unusable_timestamps_are_not_used(tmp_path, times):
    reviews = [segment(tmp_path, 1, [False, False]), segment(tmp_path, 2, [True, False, True], times)]
    mask, _, _ = imported_review(reviews, markers())
    assert np.flatnonzero(mask).tolist() == [2, 4]


def test_a_segment_without_review_still_takes_its_place(tmp_path):
    first = segment(tmp_path, 1, [True, False])
    segment(tmp_path, 2, None, ["x"] * 4)
    third = segment(tmp_path, 3, [True])
    mask, _, _ = imported_review([first, third], markers())
    assert np.flatnonzero(mask).tolist() == [0, 6]


def test_more_labels_than_frames(tmp_path):
    mask, _, notes = imported_review([segment(tmp_path, 1, [True] * 25)], markers())
    assert mask.all()
    assert len(mask) == 20
    assert "the trial has only 20" in notes[0]


def test_an_unfinished_review_is_said(tmp_path):
    _, _, notes = imported_review([segment(tmp_path, 1, [True] * 20, finished=False)], markers())
    assert "REVIEWED" in notes[0]


@pytest.mark.parametrize(
    "text",
    ['{"missing": [true]}', '{"missing_grf_data": [true, "no"]}', '{"missing_grf_data": 3}', "[true]", "{"],
)
def test_a_broken_review(tmp_path, text):
    path = tmp_path / "review.json"
    path.write_text(text)
    with pytest.raises(CaptureError, match=r"review\.json"):
        imported_review([path], markers())


def recorded(frames=200, rate=100.0, start=0.5):
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
    outside, notes = outside_ranges(((0.8, 1.0), (1.5, 9.0)), recorded())
    assert np.flatnonzero(~outside).tolist() == [*range(30, 51), *range(100, 200)]
    assert notes == (
        "forces of frames 0 to 29, 51 to 99 are not used: outside trialRanges (0.8 to 1 s, 1.5 to 9 s)",
    )


def test_rounded_times_still_find_their_frame():
    outside, _ = outside_ranges(((0.017, 0.05),), recorded(frames=10, rate=60.0, start=0.0))
    assert np.flatnonzero(~outside).tolist() == [1, 2, 3]


def test_a_range_over_the_whole_trial_leaves_nothing_out():
    outside, notes = outside_ranges(((0.0, 10.0),), recorded())
    assert not outside.any()
    assert notes == ()


def test_without_ranges_there_is_nothing_to_say():
    assert outside_ranges((), recorded()) == (None, ())


def test_a_range_beside_the_trial_is_noted_with_the_corrected_by():
    outside, (note,) = outside_ranges(((10.0, 12.0),), recorded())
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
    write_trc(place / "markers.trc", recorded())
    (trial,) = open_subject(tmp_path).trials
    assert trial.ranges == ((0.8, 1.0),)
    capture = read_trial(trial)
    assert capture.markers.frames == 200
    assert np.flatnonzero(~capture.outside_ranges).tolist() == list(range(30, 51))
    assert any("frames 0 to 29, 51 to 199 are not used" in note for note in capture.notes)
