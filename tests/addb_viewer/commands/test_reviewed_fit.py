"""What reaches the solver of people's decisions, and that an edit makes the kept fit stale."""

import sqlite3
from dataclasses import replace

import pytest

from addb_viewer.jobs import solving
from addb_viewer.jobs.review_store import FILE, open_log
from addb_viewer.jobs.solving import job_for
from annotations.events import ClearRange, FlagRange, SetStatus, Status
from solver.contact.force_review import ForceReview
from solver.fitting.fit_result import Groundwork
from solver.fitting.provenance import provenance_of
from solver.kinematics.marker_matching import MarkerMatch
from tests.flagged import flagged

FLAG = FlagRange(1, 3, "notOverForcePlate", "thigh")


@pytest.fixture
def reviewed(command_line, monkeypatch):
    """The log of the subject, which has the feet 'thigh' and 'shank' here."""
    two_feet = replace(command_line.subject, foot_bodies=("thigh", "shank"))
    monkeypatch.setattr(
        "addb_viewer.jobs.solving.open_subject", lambda folder, awaits: replace(two_feet, folder=folder)
    )
    with open_log(two_feet.folder) as log:
        yield log


def test_only_trials_that_a_person_decided_on_are_handed_over(command_line, reviewed):
    folder = command_line.subject.folder
    command_line("fit", folder)
    reviewed.append("walk", FLAG, "anna")
    command_line("fit", folder)
    reviewed.append("no/forces", SetStatus(Status.FINISHED, left_out=()), "anna")
    command_line("fit", folder)
    flag = flagged((1, 3, "thigh", "notOverForcePlate"))
    assert command_line.reviews == [
        {},
        {"walk": flag},
        {"walk": flag, "no/forces": ForceReview(stays_out=())},
    ]


def test_an_edit_makes_the_fit_stale_and_its_undo_current_again(command_line, reviewed):
    folder = command_line.subject.folder
    command_line("fit", folder)
    solves = []
    for edit in (
        lambda: reviewed.append("walk", FLAG, "anna"),
        lambda: None,
        lambda: reviewed.append("walk", ClearRange(1, 2, "thigh"), "anna"),
        lambda: reviewed.append("walk", FlagRange(1, 3, "notOverForcePlate", "thigh", "a note"), "anna"),
    ):
        edit()
        assert command_line("fit", folder).exit_code == 0
        solves.append(len(command_line.solves))
    assert solves == [2, 2, 3, 4]
    reviewed.undo("walk", "anna")
    reviewed.undo("walk", "anna")
    command_line("fit", folder)
    assert command_line.reviews[-1] == command_line.reviews[1]


def test_where_only_flags_changed_the_search_begins_at_the_kept_fit(command_line, reviewed, monkeypatch):
    """`fit` with a kept fit that has what a re-solve needs; the solver's own work is put aside."""
    begun = []

    def solve(subject, settings, **named):
        fit = whole(subject, settings, **named)
        return replace(fit, groundwork=Groundwork(fit.skeleton, MarkerMatch((), (), ()), ()))

    def resolve(previous, reviews, settings, progress, *, extension, with_std):
        begun.append((previous, reviews))
        provenance = provenance_of(previous.subject, previous.subject.trials, reviews)
        return replace(previous, provenance=provenance, held_out_due=True)

    whole = solving.solve
    monkeypatch.setattr(solving, "solve", solve)
    monkeypatch.setattr(solving, "resolve", resolve)
    monkeypatch.setattr(solving, "predict_held_out", lambda fit, *_, **__: replace(fit, held_out_due=False))
    folder = command_line.subject.folder
    command_line("fit", folder)
    reviewed.append("walk", FLAG, "anna")
    run = command_line("fit", folder)
    assert run.exit_code == 0
    assert "only flags changed" in run.stdout
    assert len(command_line.solves) == 1
    ((previous, reviews),) = begun
    assert previous.groundwork is not None
    assert reviews == {"walk": flagged((1, 3, "thigh", "notOverForcePlate"))}
    assert "unchanged" in command_line("fit", folder).stdout
    command_line("fit", folder, "--force")
    assert (len(command_line.solves), len(begun)) == (2, 1)


@pytest.mark.parametrize("command", [("fit",), ("export", "--to", "opensim")])
def test_a_review_can_be_ignored(command_line, reviewed, monkeypatch, command):
    monkeypatch.setattr("addb_viewer.jobs.exporting.export_opensim", lambda fit, folder, muscles: [])
    reviewed.append("walk", FLAG, "anna")
    folder = command_line.subject.folder
    assert command_line(command[0], folder, *command[1:], "--ignore-review").exit_code == 0
    assert command_line.reviews == [{}]


def test_disagreement_and_lost_trials_come_up_in_the_notes(command_line, reviewed):
    reviewed.append("walk", FLAG, "anna")
    reviewed.append("walk", ClearRange(0, 4), "ben")
    reviewed.append("wlak", FLAG, "anna")
    notes = job_for(command_line.subject.folder).subject.notes
    assert any(note.startswith("walk: frames 1 to 2, thigh: anna says 'notOverForcePlate'") for note in notes)
    assert "annotations.sqlite: has edits of trials that the subject does not have: wlak" in notes


def test_a_row_that_cannot_be_read_is_told_with_a_kept_fit_as_well(command_line, reviewed):
    folder = command_line.subject.folder
    command_line("fit", folder)
    reviewed.append("walk", SetStatus(Status.IN_WORK), "anna")
    with sqlite3.connect(folder / FILE) as connection:
        connection.execute(
            "INSERT INTO edits (subject, trial, author, made_at, kind, content) "
            "VALUES ('', 'walk', 'anna', 'last Tuesday', 'undo', '{\"edit\": 1}')"
        )
    connection.close()
    run = command_line("fit", folder)
    assert "unchanged" in run.stdout
    assert len(command_line.solves) == 1
    said = " ".join(run.stdout.split())
    assert said.count("walk: row 2 by anna of the review log cannot be read: its date 'last Tuesday'") == 1
    assert run.stdout == command_line("fit", folder).stdout


def test_a_flag_on_a_foot_that_is_gone_stops_the_fit_with_one_line(command_line, reviewed):
    reviewed.append("walk", FlagRange(1, 3, "manualReview", "calcn_r"), "anna")
    run = command_line("fit", command_line.subject.folder)
    assert run.exit_code == 1
    assert "walk: edit 1 by anna is about the foot 'calcn_r'; the subject has thigh, shank" in run.stderr
    assert command_line("fit", command_line.subject.folder, "--ignore-review").exit_code == 0
