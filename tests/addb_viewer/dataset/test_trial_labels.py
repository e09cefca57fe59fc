"""What is said of trials: labels, names that must not be told, what asks for a look, texts of a release."""

import json
import os
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from addb_viewer.dataset.grid import grid_of
from addb_viewer.dataset.identifiers import file_name_of, labels_without_names, without_names
from addb_viewer.dataset.release_subject import BuildOptions, Terms
from addb_viewer.dataset.release_texts import citations, licences
from addb_viewer.dataset.scanning import NOT_FITTED, UNDECIDED, concerns_of, scan, triaged
from addb_viewer.dataset.trial_labels import TrialLabels
from annotations.events import Edit, RefuseActivity, SetActivity
from annotations.folding import folded
from annotations.foot_names import side_of
from annotations.suggested_activity import SuggestedActivity
from solver.capture.capture import Markers
from solver.capture.formats.trc import write_trc
from solver.common.notes import Kind, Note
from solver.common.typed_json import plain
from tests.addb_viewer.fit_figures import force, of_subject, of_trial
from tests.addb_viewer.told_diagnosis import told_cause

FEET = ("calcn_r", "calcn_l")
WALK = SuggestedActivity(0, 60, "walk", "overground", 0.9, "rule")
STAIRS = SuggestedActivity(60, 100, "stairs", "up", 0.7, "rule (unlearnt)")


def labels(*events, suggested=(WALK, STAIRS)):
    made_at = datetime(2024, 1, 1, tzinfo=UTC)
    edits = [Edit(k, "t", "anna", made_at, event) for k, event in enumerate(events, start=1)]
    review = folded("t", tuple(edits), FEET)
    return TrialLabels(review, 100, {"anna": "reviewer_1"}).with_suggestions(suggested)


def whose(said):
    return said.of_frames(grid_of(100, 100.0, 0.0, 100.0))


def test_suggestions_hold_where_nobody_has_said_anything():
    said = labels()
    activity, sub, by = whose(said)
    assert activity == ["walk"] * 60 + ["stairs"] * 40
    assert (sub[0], sub[99]) == ("overground", "up")
    assert by == ["rule"] * 60 + ["rule (unlearnt)"] * 40
    assert (said.activity, said.by, said.confidence) == ("walk", "rule", pytest.approx(0.9))


def test_a_persons_word_stands_and_is_never_mixed_with_a_suggestion():
    said = labels(SetActivity(0, 50, "run", "overground"))
    activity, _, by = whose(said)
    assert activity == ["run"] * 50 + ["walk"] * 10 + ["stairs"] * 40
    assert by[:51] == ["person"] * 50 + ["rule"]
    assert (said.activity, said.by, said.confidence) == ("run", "person", None)
    same = labels(SetActivity(0, 40, "walk", "overground"), SetActivity(60, 100, "squat"))
    assert [(one.start, one.end, one.by) for one in same.stretches] == [
        (0, 40, "person"),
        (40, 60, "rule"),
        (60, 100, "person"),
    ]


def test_what_somebody_refused_is_not_said():
    said = labels(RefuseActivity(0, 60, "walk", "overground"))
    assert whose(said)[0] == ["none"] * 60 + ["stairs"] * 40
    assert whose(said)[2][0] == "nobody"
    assert (said.activity, said.by) == ("stairs", "rule (unlearnt)")


def test_an_erroneous_stretch_is_no_trials_label():
    said = labels(SetActivity(0, 90, "erroneous"), suggested=())
    assert (said.activity, said.by, said.confidence) == ("none", "nobody", None)


def test_certainty_is_that_of_the_mean_frame():
    again = SuggestedActivity(60, 90, "walk", "overground", 0.6, "rule")
    assert labels(suggested=(WALK, again)).confidence == pytest.approx((60 * 0.9 + 30 * 0.6) / 90)


CLOCK = "loads lie under the feet 40 ms later; do both share one clock?"
NOTES = [
    Note(Kind.FORCES_AGAINST_BODY, CLOCK, trial="walk"),
    Note(Kind.PLATES, "+y points up (…)", trial="walk"),
    Note(Kind.FORCES_AGAINST_BODY, "the largest force is 4 kN", trial="run"),
    Note(Kind.PERSON, "mass not given"),
]
CAUSES = [
    told_cause({"id": "clock_offset", "target": "", "confidence": 0.97, "trial": "walk"}),
    told_cause({"id": "carried_mass", "target": "pelvis", "confidence": 0.6}),
]


def test_what_asks_for_a_look_is_told_of_its_own_trial_alone():
    assert concerns_of("walk", NOTES, CAUSES) == ("clock_offset (97 %)", "carried_mass pelvis (60 %)", CLOCK)
    assert concerns_of("run", NOTES, CAUSES[:1]) == ("the largest force is 4 kN",)


def test_every_trial_has_a_row_fitted_or_not(walks, tmp_path):
    (one,), _ = scan([walks / "at_100"], BuildOptions(Terms("Lab", "CC0-1.0", "public")))
    (row,) = triaged(one)
    assert row.concerns == (NOT_FITTED,)
    results = one.subject.folder / "results"
    results.mkdir()
    trial = of_trial(mask_source="proposals", linear_residual=force(160.0, 0.2))
    figures = replace(of_subject(trial, mass_kg=80.0), notes=tuple(NOTES))
    try:
        (results / "fit.json").write_text(json.dumps(plain(figures)))
        (row,) = triaged(one)
        assert (row.mass_kg, row.linear_rms_bw, row.angular_rms_bwh) == (80.0, 0.2, None)
        assert row.concerns == (UNDECIDED, CLOCK)
        (results / "fit.json").write_text("{")
        (row,) = triaged(one)
        assert "fit.json" in row.concerns[0]
    finally:
        (results / "fit.json").unlink()
        results.rmdir()


@pytest.mark.parametrize(
    "source", ["a | b", "<script>x</script>", "[x](javascript:y)", "`a`", "two\nlines", "a\\|b"]
)
def test_a_source_is_one_cell_of_words(source):
    row = {"source": source, "licence": "CC-BY-4.0", "consent": "public", "url": "https://x.org/|a"}
    *_, line, end = licences([row]).split("\n")
    assert end == ""
    cells = line.replace("\\\\", "").replace("\\|", "").split("|")
    assert len(cells) == 6, "four cells between five bars"
    for sign in "<>`[]":
        assert sign not in line.replace(f"\\{sign}", "")


def test_braces_of_a_source_end_no_citation():
    text = citations([{"source": "a} {b", "citation": "Somebody {2024}"}])
    assert text.count("{") == text.count("}") == 3


def test_folders_and_files_of_any_bytes_can_stand_in_a_table(tmp_path):
    root = tmp_path / os.fsdecode(b"Z\xfcrich")
    folder = root / os.fsdecode(b"P\xe4ul")
    folder.mkdir(parents=True)
    positions = np.random.default_rng(0).uniform(0, 1.5, (200, 8, 3))
    for name in (b"g\xe9t.trc", b"st\xe4tic static.trc"):
        write_trc(folder / os.fsdecode(name), Markers(tuple("ABCDEFGH"), positions, 100.0))
    subjects, strange = scan(
        [root], BuildOptions(Terms(licence="CC0-1.0", consent="public"), unreviewed=True)
    )
    told = [
        *(one.who.subject_id for one in subjects),
        *(str(left) for one in subjects for left in one.left_out),
    ]
    assert told[0] == "Zürich/Päul"
    assert "stätic static" in "".join(told)
    assert "".join([*told, *map(str, strange)]).encode()


@pytest.mark.parametrize(
    ("body", "side"),
    [
        ("calcn_r", "r"),
        ("calcn_l", "l"),
        ("RightFoot", "r"),
        ("footL", "l"),
        ("foot_left", "l"),
        ("Left_foot", "l"),
        ("foot", None),
        ("hand_r", "r"),
    ],
)
def test_the_side_of_a_foot_is_told_by_its_name(body, side):
    assert side_of(body) == side


def test_file_names_of_identifiers():
    assert file_name_of("Lab 1/P01") == "Lab 1__P01"
    assert file_name_of("Lab:1/Zoë?") == "Lab%3A1__Zo%C3%AB%3F"


def test_labels_lose_the_persons_name_and_none_comes_twice():
    labels = ["Smith:LASI", "Smith:RASI", "LASI", "C7", "Smith:"]
    assert labels_without_names(labels) == ["LASI", "RASI", "LASI_2", "C7", "Smith:"]


@pytest.mark.parametrize(
    ("note", "told"),
    [
        ("/home/anna/data/P1/walk.trc: 3 gaps", "walk.trc: 3 gaps"),
        ("walk: markers of 2023-04-05 12:30:01 left out", "walk: markers of [date] left out"),
        ("session 20230405 and 5.4.2023", "session [date] and [date]"),
        ("Smith:LASI is up to 3 cm off", "[name]:LASI is up to 3 cm off"),
        ("frames 1999-2003 and 120 N", "frames 1999-2003 and 120 N"),
        ("Smithson stays, force/moment too", "Smithson stays, force/moment too"),
        (r"C:\data\anna\walk.trc: read", "walk.trc: read"),
    ],
)
def test_notes_lose_paths_dates_and_names(note, told):
    assert without_names(note, Path("/home/anna/data/P1"), ["Smith"]) == told
