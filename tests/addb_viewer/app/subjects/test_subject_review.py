"""The review's file is replaced, deleted or written over while open: nothing is lost, and it is told."""

import os
import shutil
import threading

import pytest

from addb_viewer.app.subjects import subject_review as review_book
from addb_viewer.app.subjects.subject_review import SubjectReview
from addb_viewer.jobs.review_store import FILE
from addb_viewer.jobs.reviewing import subject_in
from annotations.events import ClearRange, FlagRange, SetStatus, Status, Undo
from annotations.log import ReviewLog
from annotations.review_errors import ReviewError
from solver.capture.trial import read_trial
from tests.patience import PATIENCE_S

pytestmark = pytest.mark.real
FLAGS = tuple(FlagRange(10 * k, 10 * k + 5, "forceDiscrepancy", "calcn_r", f"note {k}") for k in range(4))


@pytest.fixture
def folder(real_data, tmp_path):
    folder = tmp_path / "subject"
    shutil.copytree(real_data / "walk_gait2354_subject01", folder)
    return folder


@pytest.fixture
def opened(folder):
    """Opens the subject's review as the app does; what it could not read is in `failures`."""
    subject = subject_in(folder)
    captures = {files.name: read_trial(files) for files in subject.trials}
    books = []

    def made(failed=lambda _error: None):
        books.append(SubjectReview(subject, captures.__getitem__, lambda _edits: None, failed))
        return books[-1], subject.trials[0].name

    yield made
    for book in books:
        book.close()


@pytest.fixture
def nobody_looks(monkeypatch):
    """What is found is found when an edit is made."""
    monkeypatch.setattr(review_book, "LOOK_EVERY", PATIENCE_S)


@pytest.fixture
def backup(opened, folder):
    """A copy of the file with one edit; the file itself has two by then."""
    for flag in FLAGS[:2]:
        book, trial = opened()
        book.record(trial, flag, "anna")
        book.close()
        if flag is FLAGS[0]:
            shutil.copy(folder / FILE, folder.parent / "backup")
    return folder.parent / "backup"


def put_back(file, backup):
    os.replace(backup, file)


def write_over(file, backup):
    file.write_bytes(backup.read_bytes())


def delete(file, _backup):
    file.unlink()


def rescued(folder):
    (file,) = folder.glob("annotations.rescued-*.sqlite")
    with ReviewLog.open(file) as log:
        return log.history()


@pytest.mark.usefixtures("nobody_looks")
@pytest.mark.parametrize("lose", [put_back, write_over, delete])
def test_an_edit_is_not_acknowledged_into_a_file_that_is_gone(opened, folder, backup, lose):
    book, trial = opened()
    book.record(trial, FLAGS[2], "ben")
    known = book.history(trial)
    lose(folder / FILE, backup)
    with pytest.raises(ReviewError) as first:
        book.record(trial, FLAGS[3], "anna")
    assert [(e.author, e.event) for e in rescued(folder)] == [
        *((e.author, e.event) for e in known),
        ("anna", FLAGS[3]),
    ]
    assert [e.made_at for e in rescued(folder)][:-1] == [e.made_at for e in known]
    (file,) = folder.glob("annotations.rescued-*.sqlite")
    assert str(folder / FILE) in str(first.value)
    assert file.name in str(first.value)
    for refused in (
        lambda: book.record(trial, ClearRange(0, 3), "ben"),
        lambda: book.undo(trial, "ben"),
        lambda: book.redo(trial, "ben"),
    ):
        with pytest.raises(ReviewError) as again:
            refused()
        assert str(again.value) == str(first.value)
    assert book.history(trial) == known
    assert len(rescued(folder)) == 4


@pytest.mark.usefixtures("nobody_looks")
def test_an_undo_in_flight_is_kept_and_the_rescued_file_takes_the_place(opened, folder, backup):
    book, trial = opened()
    book.record(trial, FLAGS[2], "ben")
    put_back(folder / FILE, backup)
    with pytest.raises(ReviewError, match="rescued"):
        book.undo(trial, "ben")
    book.close()
    (file,) = folder.glob("annotations.rescued-*.sqlite")
    for side in folder.glob(f"{FILE}-*"):
        side.unlink()
    os.replace(file, folder / FILE)
    book, trial = opened()
    assert book.history(trial)[-1].event == Undo(3)
    assert [flag.note for flag in book.review(trial).flags] == ["note 0", "note 1"]
    book.record(trial, SetStatus(Status.IN_WORK), "ben")


@pytest.mark.parametrize("lose", [put_back, write_over, delete])
def test_it_is_noticed_before_anybody_edits(opened, folder, backup, lose):
    heard, failures = threading.Event(), []

    def failed(error):
        failures.append(error)
        heard.set()

    book, trial = opened(failed)
    known = book.history(trial)
    lose(folder / FILE, backup)
    assert heard.wait(PATIENCE_S)
    assert "Nothing is recorded any more" in str(failures[0])
    assert "was being made" not in str(failures[0])
    assert rescued(folder) == known


def test_other_programs_and_the_logs_own_writing_are_no_loss(opened, folder):
    failures = []
    book, trial = opened(failures.append)
    for k in range(400):  # the write-ahead log is moved into the file more than once
        with ReviewLog.open(folder / FILE) as other:
            other.append(trial, FlagRange(k, k + 1, "manualReview", None, "x" * 4000), "ben")
        if k % 10 == 0:
            book.record(trial, ClearRange(k, k + 1), "anna")
    book.record(trial, FLAGS[0], "anna")
    assert len(book.history(trial)) == 441
    assert failures == []
    assert not list(folder.glob("annotations.rescued-*"))


@pytest.mark.usefixtures("nobody_looks", "backup")
def test_a_folder_that_comes_back_goes_on(opened, folder):
    """As a share that was away for a while; `backup` has put two edits into the file."""
    book, trial = opened()
    away = folder.with_name("away")
    folder.rename(away)
    with pytest.raises(ReviewError, match="2 edits so far are only in memory"):
        book.record(trial, FLAGS[2], "ben")
    away.rename(folder)
    assert book.record(trial, FLAGS[2], "ben").number == 3
    assert not list(folder.glob("annotations.rescued-*"))
