"""The page of the force benchmark says where our entry is not ahead, and what was not measured."""

import json

from addb_viewer.benchmark.results import Result, Terms, write_result
from addb_viewer.benchmark.scoring import Score
from benchmarks.forces_from_motion import ENTRIES, STARTED, behind, page


def result(name, *, sees_markers=False, **errors):
    scores = tuple(
        Score("p", "p", f"p/{activity}", activity, "grf", error, 10) for activity, error in errors.items()
    )
    return Result(name, Terms("r", "1", "s", ("p",), "unfitted", "scored"), scores, 0.0, sees_markers)


def test_only_entries_that_see_as_much_count():
    ours = result("fit-from-angles", walk=0.5, jump=1.5, squat=0.4)
    baseline = result("analytical", walk=2.0, jump=1.0, squat=0.7)
    with_markers = result("fit-from-markers", sees_markers=True, walk=0.1, jump=0.1, squat=0.1)
    lines = behind([ours, baseline, with_markers]).splitlines()
    assert lines == ["- jump (persons: 1): analytical 1.000 N/kg, fit-from-angles 1.500 N/kg"]


def test_what_was_not_measured_is_listed(tmp_path):
    made, real = tmp_path / "made" / "results", tmp_path / "real" / "results"
    (tmp_path / "made" / "release").mkdir(parents=True)
    manifest = tmp_path / "made" / "release" / "manifest.json"
    for entry in (*ENTRIES, *STARTED):
        if not entry.result.endswith(("-wide", "-started")):
            write_result(result(entry.result, walk=1.0), made)
        if entry.result != "groundlinknet-started":
            write_result(result(entry.result, walk=1.0), real)

    def lacking(persons):
        manifest.write_text(json.dumps({"totals": {"persons": persons}}))
        return page(made, real).split("## What is not measured yet")[1]

    assert "these are 17" in lacking(17)
    whole = lacking(100)
    assert "these are" not in whole
    assert "- On synthetic persons: `mlp-wide`, `groundlinknet-wide`.\n" in whole
    assert "- On real recordings: `groundlinknet-started`.\n" in whole
    without = page(None, real)
    assert "there are none yet" in without
    assert "## Synthetic persons" not in without
    assert "`mlp-started` went on from the weights learnt on the synthetic persons" in page(made, real)
