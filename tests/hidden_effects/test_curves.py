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


def test_named_and_noticed_are_counted_by_size_and_squats_are_apart():
    told = curves(CASES).splitlines()[2:]
    assert told == [
        "| walk | × 0.5 | 38 % [9, 78] (1.5/4) | 75 % [30, 95] (3/4) |",
        "| walk | × 1 | 50 % [22, 78] (4/8) | 50 % [22, 78] (4/8) |",
        "| squat | × 1 | 100 % [21, 100] (1/1) | 100 % [21, 100] (1/1) |",
    ]
