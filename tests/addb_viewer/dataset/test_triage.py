"""What is told of trials before a release is built."""

import json

from addb_viewer.dataset.release_subject import BuildOptions, Terms
from addb_viewer.dataset.scanning import NOT_FITTED, UNDECIDED, concerns_of, scan, triaged
from solver.common.notes import Kind, Note

CLOCK = "loads lie under the feet 40 ms later; do both share one clock?"
NOTES = [
    Note(Kind.FORCES_AGAINST_BODY, CLOCK, trial="walk"),
    Note(Kind.PLATES, "+y points up (…)", trial="walk"),
    Note(Kind.FORCES_AGAINST_BODY, "the largest force is 4 kN", trial="run"),
    Note(Kind.PERSON, "mass not given"),
]
CAUSES = [
    {"id": "clock_offset", "target": "", "confidence": 0.97, "trial": "walk"},
    {"id": "carried_mass", "target": "pelvis", "confidence": 0.6},
]


def test_what_asks_for_a_look_is_told_of_its_own_trial_alone():
    assert concerns_of("walk", NOTES, CAUSES) == (
        "clock_offset (97 %)",
        "carried_mass pelvis (60 %)",
        CLOCK,
    )
    assert concerns_of("run", NOTES, CAUSES[:1]) == ("the largest force is 4 kN",)


def test_every_trial_has_a_row_fitted_or_not(walks, tmp_path):
    (one,), _ = scan([walks / "at_100"], BuildOptions(Terms("Lab", "CC0-1.0", "public")))
    (row,) = triaged(one)
    assert row.concerns == (NOT_FITTED,)
    results = one.subject.folder / "results"
    results.mkdir()
    trial = {
        "name": "walk",
        "mask_source": "proposals",
        "linear_residual": {"rms_BW": 0.2},
        "angular_residual": None,
    }
    figures = {"subject": {"mass_kg": 80.0}, "trials": [trial], "notes": [note.as_json() for note in NOTES]}
    try:
        (results / "fit.json").write_text(json.dumps(figures))
        (row,) = triaged(one)
        assert (row.mass_kg, row.linear_rms_bw, row.angular_rms_bwh) == (80.0, 0.2, None)
        assert row.concerns == (UNDECIDED, CLOCK)
        (results / "fit.json").write_text("{")
        (row,) = triaged(one)
        assert "fit.json" in row.concerns[0]
    finally:
        (results / "fit.json").unlink()
        results.rmdir()
