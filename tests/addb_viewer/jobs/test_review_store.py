"""Where a subject's review lies: in its own file, or in a database that a lab shares."""

from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from addb_viewer.commands.cli import app
from addb_viewer.jobs.environment import ROOT, STORE
from addb_viewer.jobs.force_reviews import reviews_for_solve
from addb_viewer.jobs.review_store import FILE, as_proposal, open_log, subject_key
from annotations.events import ClearRange, FlagRange, Proposal
from annotations.review_errors import ReviewError
from solver.capture.capture import Markers
from solver.capture.formats.trc import write_trc
from solver.contact.detected_ranges import Proposal as Found
from tests.annotations.postgresql_server import postgresql  # noqa: F401 (a fixture)
from tests.flagged import flagged

pytestmark = pytest.mark.usefixtures("own_files")
FLAG = FlagRange(1, 3, "notOverForcePlate", "thigh")


@pytest.fixture
def subject(small_fit):
    small_fit.subject.folder.mkdir(parents=True)
    return replace(small_fit.subject, foot_bodies=("thigh", "shank"))


@pytest.fixture
def shared(postgresql, monkeypatch):  # noqa: F811 (the fixture)
    url = postgresql.new_place()
    monkeypatch.setenv(STORE, url)
    return url


def test_a_subject_keeps_its_own_file_by_default(subject):
    with open_log(subject.folder) as log:
        log.append("walk", FLAG, "anna")
    assert (subject.folder / FILE).is_file()
    assert reviews_for_solve(subject, subject.trials) == (
        {"walk": flagged((1, 3, "thigh", "notOverForcePlate"))},
        (),
    )


def test_a_shared_database_is_used_where_it_is_named(subject, shared):
    with open_log(subject.folder) as log:
        log.append("walk", FLAG, "anna")
    assert not (subject.folder / FILE).exists()
    with open_log(subject.folder) as log:
        assert len(log.history()) == 1
    with open_log(subject.folder.parent / "another") as log:
        assert log.history() == ()
    reviews, notes = reviews_for_solve(subject, subject.trials)
    assert reviews == {"walk": flagged((1, 3, "thigh", "notOverForcePlate"))}
    assert notes == ()


def test_edits_that_are_not_used_are_noted(subject, shared, monkeypatch):
    with open_log(subject.folder) as log:
        log.append("wlak", FLAG, "anna")
    monkeypatch.setenv(STORE, "")
    with open_log(subject.folder) as log:
        log.append("walk", FLAG, "anna")
    monkeypatch.setenv(STORE, shared)
    reviews, notes = reviews_for_solve(subject, subject.trials)
    assert reviews == {}
    assert notes == (
        "the shared database: has edits of trials that the subject does not have: wlak",
        "annotations.sqlite: not used, because reviews are kept in a shared database; `share` copies it "
        "there",
    )


def test_a_subject_is_named_by_its_path_below_the_root(tmp_path, monkeypatch):
    folder = tmp_path / "study2" / "S04"
    assert subject_key(folder) == "S04"
    monkeypatch.setenv(ROOT, str(tmp_path))
    assert subject_key(folder) == subject_key(folder / ".." / "S04") == "study2/S04"
    monkeypatch.setenv(ROOT, str(tmp_path / "elsewhere"))
    assert subject_key(folder) == "S04"


@pytest.mark.parametrize("command", [("flags",), ("flag", "walk", "0:1"), ("fit",)])
def test_what_is_no_url_stops_every_command_with_one_line(command_on, command):
    run = command_on("--store", "reviews.sqlite", *command)
    assert run.exit_code == 1
    assert f"{STORE} is no URL of a database; write postgresql://USER@HOST" in run.stderr
    assert "Traceback" not in run.stderr


@pytest.mark.parametrize("command", [("flags",), ("flag", "walk", "0:1"), ("fit",)])
def test_a_server_that_does_not_answer_is_one_line(command_on, command, tmp_path):
    run = command_on("--store", f"postgresql://anna:secret@/lab?host={tmp_path}", *command)
    assert run.exit_code == 1
    assert "the review log cannot be used (connection" in run.stderr
    assert "secret" not in run.stderr
    assert "Traceback" not in run.stderr


def test_commands_use_the_store_that_they_are_told(command_on, shared, monkeypatch):
    monkeypatch.setenv(STORE, "")
    flag = ("flag", "walk", "0:1", "--author", "anna", "--reason", "9")
    assert command_on("--store", shared, *flag).exit_code == 0
    assert not (command_on.folder / FILE).exists()
    monkeypatch.setenv(STORE, "")
    assert "walk: unseen" in command_on("flags").stdout
    monkeypatch.setenv(STORE, shared)
    assert "walk: in work (anna)" in command_on("flags").stdout
    assert "nothing of ben's to undo" in command_on("undo", "walk", "--author", "ben").stderr
    assert "no reviewer 'cleo'; reviewers: anna" in command_on("agreement", "cleo", "anna").stderr


def test_a_subjects_own_edits_are_copied_into_the_shared_database(command_on, shared, monkeypatch):
    assert f"has no {FILE} to copy" in command_on("share").stderr
    monkeypatch.setenv(STORE, "")
    with open_log(command_on.folder) as log:
        log.append("walk", FlagRange(0, 2, "missingBlip"), "anna")
        log.append("walk", ClearRange(1, 2), "ben")
    assert f"no shared database is named; give its URL by --store or in {STORE}" in command_on("share").stderr
    run = command_on("--store", shared, "share")
    assert run.stdout == f"2 edits copied, as '{command_on.folder.name}'; the file stays as it is\n"
    with open_log(command_on.folder) as log:
        assert [edit.author for edit in log.history()] == ["anna", "ben"]
    run = command_on("share")
    assert run.exit_code == 1
    assert "already; not copied" in run.stderr


def test_a_finding_is_proposed_with_its_detectors_version():
    found = Found((3, 9), "calcn_r", "missingBlip", 0.8, {"gap_N": 120.0})
    assert as_proposal(found, {"addb-viewer": "0.1.0", "numpy": "2.4"}) == Proposal(
        3, 9, "missingBlip", "calcn_r", 0.8, {"gap_N": 120.0}, "addb-viewer 0.1.0"
    )
    assert as_proposal(found, {}).detector == "addb-viewer"


def test_a_shared_store_that_is_named_wrongly_is_said_by_the_function(monkeypatch, tmp_path):
    monkeypatch.setenv(STORE, "S04/annotations.sqlite")
    with pytest.raises(ReviewError, match=f"{STORE} is no URL"):
        open_log(tmp_path)


class CommandOn:
    """Runs commands on a subject of one trial."""

    def __init__(self, folder):
        self.folder = folder

    def __call__(self, *arguments):
        options = [*arguments[:2]] if arguments[0] == "--store" else []
        name, *rest = arguments[len(options) :]
        return CliRunner().invoke(app, [*options, name, str(self.folder), *rest])


@pytest.fixture
def command_on(tmp_path):
    folder = tmp_path / "S04"
    folder.mkdir()
    write_trc(folder / "walk.trc", Markers(("HEAD",), np.full((2, 1, 3), 1.7), 100.0))
    return CommandOn(folder)
