"""The page of predicted forces says where our entry is not ahead."""

from addb_viewer.benchmark.results import Result, Terms
from addb_viewer.benchmark.scoring import Score
from benchmarks.no_plates import baselines_section


def result(name, *, sees_markers=False, **errors):
    scores = tuple(
        Score("p", "p", f"p/{activity}", activity, "grf", error, 10) for activity, error in errors.items()
    )
    return Result(name, Terms("r", "1", "s", ("p",), "unfitted", "scored"), scores, 0.0, sees_markers)


def test_only_entries_that_see_as_much_count():
    ours = result("fit-from-angles", walk=0.5, jump=1.5, squat=0.4)
    baseline = result("analytical", walk=2.0, jump=1.0, squat=0.7)
    with_markers = result("fit-from-markers", sees_markers=True, walk=0.1, jump=0.1, squat=0.1)
    page = baselines_section([ours, baseline, with_markers])
    told = page.split("**Where ours is not ahead**\n\n")[1].split("\n\n")[0]
    assert told == "- jump (persons: 1): analytical 1.000 N/kg, fit-from-angles 1.500 N/kg"
