import json

import numpy as np
import pytest

from solver.capture.capture import Markers
from solver.capture.subject.review import imported_review
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
