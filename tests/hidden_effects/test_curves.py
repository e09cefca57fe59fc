"""Rates by size, on synthetic answers."""

from benchmarks.diagnosis.curves import curves
from benchmarks.diagnosis.judge import Verdict
from benchmarks.diagnosis.score import Scored


def answered(id, size, outcome, activity="walk"):
    truth = {"effects": [{"id": id, "size": size}], "world": {"world": {"activity": activity}}}
    return Scored(truth, {}, Verdict("case", "single", outcome))


CASES = [
    *[answered("clock_offset", 0.5, outcome) for outcome in ("right", "missed", "wrong", "class")],
    *[answered("clock_offset", 1.0, "right")] * 4,
    *[answered("drag", 1.0, "missed")] * 4,
    answered("drag", 1.0, "right", "squat"),
    answered("plate_swap", 1.0, "right"),
]


def test_named_and_noticed_are_counted_by_effect_and_size():
    page = curves(CASES)
    assert "| clock_offset | 1.5 (3) of 4 | 4 (4) of 4 | 1 |" in page
    assert "| drag |  | 0 (0) of 4 | - |" in page


def test_squats_are_apart_and_what_has_no_size_is_left_out():
    walks, squats = curves(CASES).split("## Squats")
    assert "| × 1 | 50 % [22, 78] (4/8) | 50 % [22, 78] (4/8) |" in walks
    assert "| drag | 1 (1) of 1 | 1 |" in squats
    assert "plate_swap" not in walks + squats
