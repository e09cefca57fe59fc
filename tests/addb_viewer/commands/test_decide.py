"""`flag`, `flags`, `undo`, `redo`, `mark`, `agreement`: editing and reading the review log by command."""

import csv
import json
import sqlite3

import numpy as np
import pytest
from typer.testing import CliRunner

from addb_viewer.commands.cli import app
from addb_viewer.commands.decide import foot_named
from annotations.events import AcceptProposal, ImportLabels, Proposal, RejectProposal, SetActivity
from annotations.log import ReviewLog
from solver.capture.capture import Markers
from solver.capture.formats.trc import write_trc
from solver.contact.detected_ranges import Proposal as Found
from solver.fitting.results.kept_trials import KeptTrial

FRAMES = 40


@pytest.fixture
def folder(tmp_path):
    """A subject of two trials; a review.json of `walk` says that its first ten frames lack force."""
    places = np.tile([[0.0, 1.7, 0.0], [0.1, 0.05, 0.0]], (FRAMES, 1, 1))
    for trial in ("walk", "run"):
        write_trc(tmp_path / f"{trial}.trc", Markers(("HEAD", "R.Heel"), places, 100.0))
    (tmp_path / "segment_1").mkdir()
    labels = [t < 10 for t in range(FRAMES)]
    (tmp_path / "segment_1" / "review.json").write_text(json.dumps({"missing_grf_data": labels}))
    (tmp_path / "subject.toml").write_text(
        '[trials.walk]\nmarkers = "walk.trc"\nreview = "segment_1/review.json"\n'
        '[trials.run]\nmarkers = "run.trc"\n'
    )
    return tmp_path


@pytest.fixture
def run(folder):
    """Runs a command on the subject; a failure is told with what it printed."""

    def command(name, *arguments, status=0):
        result = CliRunner().invoke(app, [name, str(folder), *map(str, arguments)])
        assert result.exit_code == status, result.output
        return result.stdout if status == 0 else " ".join(result.stderr.replace("│", " ").split())

    return command


def log_of(folder):
    return ReviewLog.open(folder / "annotations.sqlite")


def test_a_flag_is_recorded_with_foot_reason_note_and_author(run, folder):
    printed = run(
        "flag", "run", "12:18", "--foot", "right", "--reason", "notOverForcePlate", "--note", "edge",
        "--author", "anna",
    )  # fmt: skip
    assert printed == "run: frames 12 to 17, calcn_r: notOverForcePlate (edit 1)\n"
    with log_of(folder) as log:
        (edit,) = log.history("run")
    event = edit.event
    assert (event.start, event.end, event.foot, event.reason, event.note, edit.author) == (
        12, 18, "calcn_r", "notOverForcePlate", "edge", "anna",
    )  # fmt: skip


def test_the_login_name_is_the_author_and_both_feet_are_meant_unless_said(run, folder, monkeypatch):
    monkeypatch.setattr("getpass.getuser", lambda: "zoë")
    assert run("flag", "run", "12:") == "run: frames 12 to 39, both feet: manualReview (edit 1)\n"
    assert "12:40  both  manualReview  person (zoë, edit 1)" in run("flags", "run")


def test_without_a_login_name_an_author_has_to_be_given(run, monkeypatch):
    def nobody():
        raise OSError("no entry for uid 1000")

    monkeypatch.setattr("getpass.getuser", nobody)
    assert "--author" in run("flag", "run", "12:14", status=2)
    run("flag", "run", "12:14", "--author", "anna")


def test_a_first_edit_stands_on_the_review_json(run):
    run("flag", "walk", "8:20", "--author", "anna", "--reason", "7")
    listed = run("flags", "walk").splitlines()
    assert listed[0] == "walk: in work (anna)"
    assert [line.split()[:3] for line in listed[1:]] == [
        ["0:8", "both", "manualReview"],
        ["8:20", "both", "interpolatedClippedGRF"],
    ]
    run("flag", "walk", ":5", "--clear", "--author", "anna")
    assert run("flags", "walk").splitlines()[1].split()[0] == "5:8"


def test_reviewers_who_differ_are_told_so_at_once(run):
    run("flag", "run", "10:20", "--author", "anna")
    printed = run("flag", "run", "15:30", "--clear", "--author", "ben")
    assert "note: run: frames 15 to 19: anna says 'manualReview' (edit 1), ben says" in printed
    assert "the later one, ben's, counts" in run("flags", "run")


def test_undo_and_redo_by_step_and_by_number(run):
    for start in (0, 10, 20):
        run("flag", "run", f"{start}:{start + 5}", "--author", "anna")
    assert run("undo", "run", "--author", "anna").startswith("run: undone: edit 3, ")
    assert run("undo", "run", "--edit", 1, "--author", "anna").startswith("run: undone: edit 1, ")
    assert [line.split()[0] for line in run("flags", "run").splitlines()[1:]] == ["10:15"]
    assert run("redo", "run", "--author", "anna").startswith("run: counts again: edit 1, ")
    assert "nothing of ben's to undo" in run("undo", "run", "--author", "ben", status=1)
    history = run("flags", "run", "--history").splitlines()
    assert [line.split(",")[0] for line in history[:6]] == [f"run: edit {k}" for k in range(1, 7)]
    assert history[0].endswith("UTC, anna: frames 0 to 4, all feet: the force does not count, other")


def test_nothing_to_undo_makes_no_log(run, folder):
    assert "walk: nobody has flagged anything yet" in run("undo", "walk", status=1)
    assert run("flags").splitlines() == [
        "walk: unseen, nothing flagged, its review.json decides",
        "run: unseen, nothing flagged",
    ]
    assert not (folder / "annotations.sqlite").exists()


def test_a_status_is_marked_with_what_others_should_know(run):
    said = run("mark", "walk", "second-look", "--author", "ben", "--note", "plate 2 drifts")
    assert said == "walk: needs a second look (edit 2)\n"
    assert run("flags", "walk").startswith("walk: needs a second look (ben, plate 2 drifts)\n  0:10  both")


def test_flags_as_json_csv_and_review_json(run, tmp_path):
    run("flag", "run", "12:18", "--foot", "left", "--author", "anna")
    run("mark", "run", "finished", "--author", "anna")
    out = tmp_path / "out"
    run("flags", "--json", tmp_path / "f.json", "--csv", tmp_path / "f.csv", "--review-json", out)
    walk, runs = json.loads((tmp_path / "f.json").read_text())["trials"]
    assert (walk["name"], walk["status"], walk["missing"]) == ("walk", "unseen", [])
    assert (runs["status"], runs["status_author"]) == ("finished", "anna")
    assert runs["missing"] == [
        {
            "range": [12, 18], "foot": "calcn_l", "reason": "manualReview", "source": "person",
            "author": "anna", "edit": 1, "note": "", "confidence": None, "detector": "",
        }
    ]  # fmt: skip
    with (tmp_path / "f.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["foot"], row["status"]) for row in rows] == [("calcn_l", ""), ("", "finished")]
    labels = json.loads((out / "run" / "segment_1" / "review.json").read_text())["missing_grf_data"]
    assert (len(labels), np.flatnonzero(labels).tolist()) == (FRAMES, [12, 13, 14, 15, 16, 17])
    assert (out / "run" / "segment_1" / "REVIEWED").is_file()
    assert not (out / "walk").exists()


def test_what_review_json_has_no_place_for_is_listed(run, folder, tmp_path):
    run("flag", "run", "12:18", "--foot", "left", "--author", "anna", "--reason", "3", "--note", "a rope")
    run("flag", "run", "15:20", "--clear", "--author", "ben")
    with log_of(folder) as log:
        log.append("run", SetActivity(0, 20, "squat"), "anna")
    printed = run("flags", "run", "--review-json", tmp_path / "out")
    assert (
        "note: run: review.json has no place for which foot, reasons, notes, activities, the status, who "
        "disagrees with whom; --csv has"
    ) in printed


def test_an_activity_and_an_accepted_proposal_are_listed_with_their_figures(run, folder):
    proposal = Proposal(5, 8, "missingBlip", "calcn_r", 0.875, {}, "detector 1")
    with log_of(folder) as log:
        log.append("run", AcceptProposal(proposal), "anna")
        log.append("run", RejectProposal(Proposal(20, 22, "missingBlip")), "anna")
        log.append("run", SetActivity(0, 40, "run", "treadmill", "3 m/s"), "ben")
    assert run("flags", "run").splitlines()[1:] == [
        "  5:8  calcn_r  missingBlip  accepted proposal 0.88 (anna, edit 1)",
        "  0:40  run treadmill (ben, edit 3)  3 m/s",
    ]
    run("flags", "run", "--json", folder / "f.json")
    (figures,) = json.loads((folder / "f.json").read_text())["trials"]
    assert (figures["missing"][0]["confidence"], figures["missing"][0]["detector"]) == (0.875, "detector 1")
    assert figures["cleared"] == [
        {
            "range": [20, 22], "foot": None, "source": "rejected proposal", "author": "anna", "edit": 2,
            "note": "",
        }
    ]  # fmt: skip
    assert figures["activities"][0]["note"] == "3 m/s"


def test_a_table_goes_out_of_one_subject_and_into_another(run, folder, tmp_path):
    run("flag", "run", "12:18", "--foot", "left", "--author", "anna", "--reason", "3", "--note", "a rope")
    run("flag", "walk", "0:4", "--clear", "--author", "anna")
    run("flags", "--csv", tmp_path / "labels.csv")
    (folder / "annotations.sqlite").unlink()
    printed = run("label", tmp_path / "labels.csv", "--author", "ben")
    assert printed.splitlines() == [
        "walk: 2 ranges imported, in work (edit 2)",
        "run: 1 ranges imported, in work (edit 3)",
        "note: not imported: the columns source, author, edit, confidence, detector",
    ]
    listed = run("flags").splitlines()
    assert [line.split()[:3] for line in listed if line.startswith("  ")] == [
        ["4:10", "both", "manualReview"],
        ["12:18", "calcn_l", "unmeasuredExternalForceDetected"],
    ]
    with log_of(folder) as log:
        assert log.history("run")[-1].event.by == "ben"
        assert isinstance(log.history("walk")[0].event, ImportLabels)  # the trial's own review.json


def test_a_table_with_a_wrong_row_changes_nothing(run, folder, tmp_path):
    table = tmp_path / "labels.csv"
    table.write_text("trial,start,end,reason\nrun,3,5,missingBlip\nrun,3,500,missingBlip\n")
    assert "labels.csv, line 3: 3:500 is not within the trial, which is 0:40" in run("label", table, status=1)
    table.write_bytes("trial,start,end,reason,note\nrun,3,5,missingBlip,à\n".encode("latin-1"))
    assert "labels.csv: is not UTF-8 text" in run("label", table, status=1)
    assert "no.csv: No such file" in run("label", tmp_path / "no.csv", status=1)
    assert not (folder / "annotations.sqlite").exists()


def test_a_review_that_nobody_made_here_is_not_written(run, tmp_path):
    printed = run("flags", "walk", "--review-json", tmp_path / "out")
    assert "note: walk: nobody has reviewed it here; no review.json written" in printed
    assert not (tmp_path / "out").exists()


def test_agreement_of_two_reviewers(run, tmp_path):
    run("flag", "run", "0:20", "--author", "anna")
    run("flag", "run", "0:16", "--author", "ben")
    printed = run("agreement", "anna", "ben", "--json", tmp_path / "kappa.json")
    assert printed == "run: κ 0.80, 90.0% the same; differ on 16:20\n"
    figures = json.loads((tmp_path / "kappa.json").read_text())
    assert figures["reviewers"] == ["anna", "ben"]
    assert figures["trials"][0]["kappa"] == pytest.approx(0.8)
    assert figures["trials"][0]["differ"] == [[16, 20]]
    assert "no reviewer 'bea'; reviewers: anna, ben" in run("agreement", "anna", "bea", status=1)


def test_agreement_on_activities(run, folder):
    with log_of(folder) as log:
        for author, end in (("anna", 20), ("ben", 16)):
            log.append("run", SetActivity(0, end, "squat"), author)
            log.append("run", SetActivity(end, 40, "standing"), author)
    assert run("agreement", "anna", "ben", "--json", folder / "kappa.json").splitlines() == [
        "run: κ –, 100.0% the same; differ on nowhere",
        "run, activities: κ 0.80, 90.0% the same; differ on 16:20",
    ]
    figures = json.loads((folder / "kappa.json").read_text())
    assert figures["trials"][0]["activities"]["differ"] == [[16, 20]]


def test_a_reviewer_against_the_imported_labels(run):
    run("flag", "walk", "5:15", "--author", "anna")
    run("flag", "walk", "0:5", "--clear", "--author", "anna")
    assert "walk: κ 0.33, 75.0% the same; differ on 0:5, 10:15" in run("agreement", "anna", "imported")


@pytest.mark.parametrize(
    ("arguments", "status", "said"),
    [
        (("jump", "0:5"), 1, "no trial 'jump'; nearest: walk, run"),
        (("wlk", "0:5"), 1, "no trial 'wlk'; nearest: walk"),
        (("walk", "30:41"), 1, "walk: 30:41 is not within the trial, which is 0:40"),
        (("walk", "5"), 2, "'5' is no range; write START:END, as in 120:180"),
        (("walk", "5:5"), 2, "no frames in '5:5'; END is the first frame after the range"),
        (("walk", "41:"), 2, "no frames in '41:'"),
        (("walk", "0:5", "--reason", "notOverPlate"), 2, "nearest: notOverForcePlate"),
        (("walk", "0:5", "--reason", "notMissingGRF"), 2, "clear the range instead"),
        (("walk", "0:5", "--clear", "--reason", "1"), 2, "a cleared range has no reason"),
        (("walk", "0:5", "--foot", "toes"), 2, "'toes' is not clear; give both or one of: calcn_r, calcn_l"),
        (("walk", "0:5", "--author", "imported"), 1, "a person needs another name"),
    ],
)
def test_a_wrong_flag_says_what_is_wrong_and_changes_nothing(run, arguments, status, said):
    assert said in run("flag", *arguments, status=status)
    assert run("flags", "walk").startswith("walk: unseen")


@pytest.mark.parametrize(
    ("word", "feet", "foot"),
    [
        ("both", ("calcn_r", "calcn_l"), None),
        ("right", ("calcn_r", "calcn_l"), "calcn_r"),
        ("left", ("LeftFoot", "RightFoot"), "LeftFoot"),
        ("right", ("footL", "footR"), "footR"),
        ("left", ("r_foot", "l_foot"), "l_foot"),
        ("toes_l", ("calcn_r", "toes_l"), "toes_l"),
    ],
)
def test_feet_by_side_or_by_name(word, feet, foot):
    assert foot_named(word, feet) == foot


def test_a_log_of_a_newer_version_stops_every_command_with_one_line(run, folder):
    run("flag", "run", "0:5", "--author", "anna")
    with sqlite3.connect(folder / "annotations.sqlite") as raw:
        raw.execute("UPDATE annotations_version SET version_num = '0099'")
    raw.close()
    for command in (("flags",), ("flag", "run", "0:5"), ("undo", "run"), ("fit",)):
        assert "made by another version of addb-viewer" in run(*command, status=1)


@pytest.fixture
def detected(monkeypatch):
    """A kept fit whose detection is sure of two findings in each trial, and unsure of a third."""
    found = (
        Found((20, 25), None, "missingBlip", 0.9),
        Found((30, 35), "calcn_r", "forceDiscrepancy", 0.9),
        Found((36, 39), None, "forceDiscrepancy", 0.1),
    )
    monkeypatch.setattr(
        "solver.fitting.results.kept_trials.kept_trials",
        lambda _: dict.fromkeys(("run", "walk"), KeptTrial((), found, None)),
    )


def test_finishing_over_what_nobody_decided_is_refused_or_said(run, folder, detected):
    run("flag", "run", "20:25", "--clear", "--author", "anna")
    result = run("mark", "run", "finished", "--author", "anna", status=1)
    assert "frames 30 to 34, calcn_r, force wrong" in result
    assert "frames 20" not in result
    said = run("mark", "run", "finished", "--author", "anna", "--undecided-stay-out")
    assert "frames 30 to 34, calcn_r, force wrong was not decided by anybody and stays left out" in said
    listed = run("flags", "run")
    assert "30:35  calcn_r  forceDiscrepancy  undecided proposal 0.90 (anna, edit 2)" in listed
    run("flag", "run", "32:35", "--clear", "--author", "ben")
    run("flags", "run", "--json", str(folder / "flags.json"), "--csv", str(folder / "flags.csv"))
    (trial,) = json.loads((folder / "flags.json").read_text(encoding="utf-8"))["trials"]
    assert [flag["range"] for flag in trial["stays_out"]] == [[30, 32]]
    assert "run,30,32,calcn_r,forceDiscrepancy" in (folder / "flags.csv").read_text(encoding="utf-8")


def test_where_an_imported_review_decides_nothing_is_undecided(run, detected):
    assert run("mark", "walk", "finished", "--author", "anna") == "walk: finished (edit 2)\n"


def test_what_nobody_has_looked_at_is_finished_only_by_a_word_more(run):
    refused = run("mark", "run", "finished", "--author", "anna", status=1)
    assert "run: nobody has looked at it" in refused
    assert "unseen" in run("flags", "run")
    assert "run: finished (edit 1)" in run("mark", "run", "finished", "--author", "anna", "--unseen")


def test_finishing_what_was_never_fitted_says_who_decides_then(run):
    said = run("mark", "run", "finished", "--author", "anna", "--unseen")
    assert "run: not fitted yet; what detection will leave out stays left out" in said


@pytest.mark.parametrize("option", ["--csv", "--json"])
def test_a_table_replaces_no_recording(run, folder, option):
    recording = next(folder.rglob("*.trc"))
    before = recording.read_bytes()
    assert "Name another file" in run("flags", option, recording, status=2)
    assert recording.read_bytes() == before
