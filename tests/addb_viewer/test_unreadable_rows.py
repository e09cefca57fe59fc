"""A bad row in the review of a real subject stops no command, no log and no page, and is told everywhere."""

import json
import shutil
import sqlite3
import threading

import pytest
from sqlalchemy import text
from typer.testing import CliRunner

from addb_viewer.app.queue.queue_rows import subject_rows
from addb_viewer.app.review.review_html import ranges_html
from addb_viewer.app.subjects.library import library_of
from addb_viewer.app.subjects.subject_review import SubjectReview
from addb_viewer.commands.cli import app
from addb_viewer.jobs import review_store
from addb_viewer.jobs.environment import STORE
from addb_viewer.jobs.force_reviews import reviews_for_solve
from addb_viewer.jobs.review_store import FILE, open_log
from addb_viewer.jobs.reviewing import subject_in
from addb_viewer.jobs.solving import job_for
from annotations.database import Database
from annotations.events import ClearRange, FlagRange, Status
from annotations.review_errors import ReviewError
from solver.capture.trial import read_trial
from tests.annotations.postgresql_server import postgresql  # noqa: F401 (a fixture)

TRIAL = "walk1"
PATIENCE_S = 60.0  # only a hang takes that long
DATE = "2024-09-01T12:00:00+00:00"
CONTENT = json.dumps({"start": 60, "end": 70, "reason": "missingBlip", "foot": None, "note": ""})
BAD, WHY = ("flag", CONTENT, "last Tuesday"), "its date 'last Tuesday' is none"
INSERT = (
    "INSERT INTO edits (subject, trial, author, made_at, kind, content) "
    "VALUES (:subject, :trial, 'anna', :made_at, :kind, :content)"
)
WHOLE = "SELECT number, trial, author, made_at, kind, CAST(content AS TEXT) FROM edits ORDER BY number"

pytestmark = [pytest.mark.real, pytest.mark.usefixtures("own_files")]


@pytest.fixture
def folder(real_data, tmp_path):
    """A real subject; nobody has decided anything yet."""
    folder = tmp_path / "subject"
    shutil.copytree(real_data / "walk_gait2354_subject01", folder)
    return folder


@pytest.fixture(params=["sqlite", "postgresql"])
def database(request, folder, monkeypatch, own_files):
    """Where the subject's review is: in its own file, or in a laboratory's database."""
    if request.param == "postgresql":
        monkeypatch.setenv(STORE, request.getfixturevalue("postgresql").new_place())
    open_log(folder).close()
    opened = Database(review_store.store_url() or folder / FILE)
    yield opened
    opened.close()


@pytest.fixture
def _decided(database, folder):
    """anna has flagged frames 10 to 19, ben has cleared frame 15 on."""
    with open_log(folder) as log:
        log.append(TRIAL, FlagRange(10, 20, "notOverForcePlate", "calcn_r"), "anna")
        log.append(TRIAL, ClearRange(15, 25, "calcn_r"), "ben")


@pytest.fixture
def spoil(database, folder):
    """Puts a row into the log by hand; gives its number."""

    def written(kind, content, made_at, trial=TRIAL):
        subject = review_store.subject_key(folder) if review_store.store_url() else ""
        row = {"subject": subject, "trial": trial, "made_at": made_at, "kind": kind, "content": content}
        with database.writing() as connection:
            connection.execute(text(INSERT), row)
            return connection.scalar(text("SELECT max(number) FROM edits"))

    return written


@pytest.fixture
def run(folder):
    """Runs a command on the subject; gives its output in one line."""

    def command(name, *arguments, status=0):
        result = CliRunner().invoke(app, [name, str(folder), *map(str, arguments)])
        assert result.exit_code == status, result.output
        assert "Traceback" not in result.output
        return " ".join(result.output.split())

    return command


@pytest.fixture
def book(folder):
    """The review as the app has it; which edits it heard of, and what it said it could not read."""
    subject = subject_in(folder)
    heard, failures, told = [], [], threading.Event()

    def failed(error):
        failures.append(error)
        told.set()

    captures = {files.name: read_trial(files) for files in subject.trials}
    opened = SubjectReview(subject, captures.__getitem__, heard.append, failed)
    opened.heard, opened.failures, opened.told = heard, failures, told
    yield opened
    opened.close()


def stored(database):
    with database.reading() as connection:
        return [tuple(row) for row in connection.execute(text(WHOLE))]


@pytest.mark.usefixtures("_decided")
def test_every_command_goes_on_and_tells_of_the_row(run, folder, database, spoil):
    number = spoil(*BAD)
    before, said = stored(database), f"note: {TRIAL}: row {number} by anna of the review log cannot be read: "
    for command in (("flags",), ("flags", TRIAL, "--history"), ("agreement", "anna", "ben")):
        printed = run(*command)
        assert said in printed
        assert WHY in printed
        assert "Its decision does not count" in printed
    job = job_for(folder)
    (note,) = [note for note in job.subject.notes if "cannot be read" in note]
    assert note.startswith(said.removeprefix("note: "))
    assert WHY in note
    assert [(label.start, label.end) for label in job.reviews[TRIAL].by_people] == [(10, 15), (15, 25)]
    run("flags", "--json", folder.parent / "flags.json")
    trials = json.loads((folder.parent / "flags.json").read_text())["trials"]
    (row,) = next(trial for trial in trials if trial["name"] == TRIAL)["unreadable"]
    assert (row["row"], row["author"]) == (number, "anna")
    assert stored(database) == before
    for command in (
        ("flag", TRIAL, "30:40", "--author", "ben"),
        ("undo", TRIAL, "--author", "ben"),
        ("redo", TRIAL, "--author", "ben"),
        ("mark", TRIAL, "finished", "--author", "ben"),
    ):
        assert said in run(*command)
    assert f"row {number} by anna cannot be read, so undo" in run("undo", TRIAL, "--author", "anna", status=1)
    assert stored(database)[: len(before)] == before


def test_a_row_of_another_or_no_trial_of_the_subject_is_told_as_well(run, folder, spoil):
    number = spoil("merge", CONTENT, DATE, trial="wlak")
    assert f"note: wlak: row {number} by anna" in run("flags")
    assert "cannot be read" not in run("flags", TRIAL)
    subject = subject_in(folder)
    _, notes = reviews_for_solve(subject, subject.trials)
    assert [note.partition(" of the")[0] for note in notes if "read" in note] == [
        f"wlak: row {number} by anna"
    ]


def test_sharing_refuses_to_leave_a_decision_behind_unless_it_is_told_to(
    run,
    folder,
    monkeypatch,
    postgresql,  # noqa: F811 (the fixture)
):
    with open_log(folder) as log:
        log.append(TRIAL, FlagRange(10, 20, "notOverForcePlate", "calcn_r"), "anna")
        with sqlite3.connect(folder / FILE) as connection:
            connection.execute(
                "INSERT INTO edits (subject, trial, author, made_at, kind, content) "
                "VALUES ('', ?, 'anna', ?, 'flag', '{\"start\": 1')",
                (TRIAL, DATE),
            )
        connection.close()
        log.append(TRIAL, ClearRange(15, 25, "calcn_r"), "ben")
        monkeypatch.setenv(STORE, postgresql.new_place())
        refused = run("share", status=1)
        missing = f"what cannot be read would be missing there: row 2 by anna of {TRIAL}"
        assert f"nothing was copied, because {missing}" in refused
        assert "its content is not JSON" in refused
        assert "share --without-unreadable" in refused
        with open_log(folder) as shared:
            assert shared.history() == ()
        done = run("share", "--without-unreadable")
        assert "2 edits copied" in done
        assert f"note: not copied: {TRIAL}: row 2 by anna" in done
        with open_log(folder) as shared:
            assert [edit.author for edit in shared.history()] == ["anna", "ben"]
        assert [row.number for row in log.unreadable()] == [2]


@pytest.mark.usefixtures("_decided")
def test_the_app_hears_of_the_row_once_says_so_on_the_page_and_goes_on(book, folder, spoil):
    number = spoil(*BAD)
    assert book.told.wait(PATIENCE_S)
    edit = book.record(TRIAL, ClearRange(30, 40), "ben")
    assert edit.number == number + 1
    (failure,) = book.failures
    assert isinstance(failure, ReviewError)
    assert f"{TRIAL}: row {number} by anna of the review log cannot be read" in str(failure)
    assert () in book.heard
    review = book.review(TRIAL)
    assert [row.number for row in review.unreadable] == [number]
    assert f"⚠ row {number} by anna of the review log cannot be read" in ranges_html(review)
    with pytest.raises(ReviewError, match="undo does not go back beyond it"):
        book.undo(TRIAL, "anna")
    assert [flag.author for flag in book.review(TRIAL).flags] == ["anna"]
    assert book.undo(TRIAL, "ben").number == edit.number
    (row,) = [row for row in subject_rows("S1", subject_in(folder)) if row.trial == TRIAL]
    assert (row.status, row.by) == (Status.IN_WORK, "ben")


def test_a_page_that_opens_later_says_it_too_and_claims_nothing(folder, spoil):
    number = spoil("merge", CONTENT, DATE)
    subject = subject_in(folder)
    late = SubjectReview(subject, lambda name: library_of(subject).capture(name), list, list)
    try:
        review = late.review(TRIAL)
        assert [row.number for row in review.unreadable] == [number]
        assert review.status is Status.IN_WORK
        page = ranges_html(review)
        assert f"row {number}" in page
        assert "Every force counts" not in page
    finally:
        late.close()
