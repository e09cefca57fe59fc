"""What the reviewer of twenty trials is told of the truth, and how keys are counted."""

import numpy as np

from benchmarks.review_by_key import SHIFT_T, SOLVE, YES, Count, T, missing_frames, table

FEET = ("calcn_r", "calcn_l")


def test_a_force_is_missing_from_the_first_to_the_last_moment_of_a_contact():
    times = 2.0 + np.arange(10) / 100.0
    missing = missing_frames(times, FEET, (("calcn_l", 2.025, 2.055), ("calcn_r", 0.0, 1.0)))
    assert np.flatnonzero(missing[:, 1]).tolist() == [3, 4, 5]
    assert not missing[:, 0].any()


def test_every_trial_is_counted_in_its_kind_and_wrong_decisions_show():
    counts = [
        Count(("a", "1"), 1, 1, 0, ["N", "Backspace", SOLVE, YES, T]),
        Count(("a", "2"), 3, 0, 0, ["N", SHIFT_T]),
        Count(("a", "3"), 0, 0, 1, ["W", "2", SOLVE, YES, T]),
        Count(("a", "4"), 0, 0, 0, [T, T]),
    ]
    right = {count.place: count.place[1] != "3" for count in counts}
    lines = [[cell.strip() for cell in line.split("|")] for line in table(counts, right).splitlines()[2:7]]
    rows = {kind: " ".join(cells) for _, kind, *cells, _ in lines}
    assert rows["one proposal"] == "1 1 1 0 1 5.0 5"
    assert rows["all right, Shift T"] == "1 3 0 0 1 2.0 2"
    assert rows["a step missed by detection"] == "1 0 0 1 0 5.0 5"
    assert rows["all"] == "4 4 1 1 3 3.5 5"
    assert "4 of the 14 keys are for solving and keeping" in table(counts, right)
