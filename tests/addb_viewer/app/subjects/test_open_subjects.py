"""Subjects are read ahead of the reviewer who comes to them, and read again where something has changed."""

import os
import threading
from dataclasses import replace

import pytest

from addb_viewer.app.jobs.job_queue import Task
from addb_viewer.app.subjects import open_subjects
from addb_viewer.app.subjects.library import library_of
from addb_viewer.app.subjects.open_subjects import OpenSubjects
from addb_viewer.jobs.root_folder import RootFolder
from solver.capture.capture import TrialFiles
from solver.common.errors import CaptureError
from solver.fitting.results.store import save_fit
from tests.patience import PATIENCE_S

NAMES = ("Anna", "Ben", "Chen")


@pytest.fixture
def read(monkeypatch, tmp_path):
    """Names of the subjects whose fit is read, one after the other."""
    names = []

    def counted(subject, results=None):
        if subject.folder.is_relative_to(tmp_path):  # an app of another test may still read
            names.append(subject.folder.name)
        return library_of(subject, results)

    monkeypatch.setattr(open_subjects, "library_of", counted)
    monkeypatch.setattr(open_subjects, "AHEAD_AFTER_S", 0.0)
    return names


@pytest.fixture
def subjects(small_fit, tmp_path, read):
    root = tmp_path / "root"
    opened = OpenSubjects(RootFolder(root, NAMES))
    fits = {name: _moved_to(small_fit, root / name) for name in NAMES}
    opened.read = lambda name: fits[name].subject
    for name, fit in fits.items():
        save_fit(fit, root / name / "results")
    yield opened
    opened.close()


def _moved_to(fit, folder):
    """The same fit, of recordings in this folder."""
    folder.mkdir(parents=True)
    files = tuple(
        TrialFiles(name=trial.name, markers=folder / f"{k}.trc") for k, trial in enumerate(fit.subject.trials)
    )
    captures = (replace(t.capture, files=(f.markers,)) for t, f in zip(fit.trials, files, strict=True))
    trials = tuple(replace(t, capture=c) for t, c in zip(fit.trials, captures, strict=True))
    return replace(fit, subject=replace(fit.subject, folder=folder, trials=files), trials=trials)


def ahead(subjects, name, trial="walk"):
    """Read it, and wait until that is done."""
    subjects.read_ahead(name, trial)
    for thread in threading.enumerate():
        if thread.name == f"reading {name} ahead":
            thread.join(PATIENCE_S)


def test_a_subject_that_was_read_ahead_is_not_read_again_when_somebody_comes(subjects, read):
    ahead(subjects, "Ben")
    assert read == ["Ben"]
    shared = subjects.subject("Ben")
    assert read == ["Ben"]
    assert "walk" in shared.fits.shown.kept
    subjects.subject("Anna")
    assert read == ["Ben", "Anna"]


def test_a_subject_that_is_open_has_its_next_trial_read(subjects, read):
    shared = subjects.subject("Ben")
    ahead(subjects, "Ben", "no/forces")
    assert read == ["Ben"]
    assert "no/forces" in shared.fits.shown.kept


def test_what_has_changed_since_or_is_old_is_read_again(subjects, read, monkeypatch):
    for name in NAMES:
        ahead(subjects, name)
    os.utime(subjects.root.path / "Ben" / "results" / "fit.json", ns=(1, 1))
    subjects.subject("Ben")
    assert read == [*NAMES, "Ben"]
    subjects.subject("Chen")
    assert read == [*NAMES, "Ben"]
    monkeypatch.setattr(open_subjects, "OLDEST_AHEAD_S", -1.0)
    subjects.subject("Anna")
    assert read == [*NAMES, "Ben", "Anna"]


def test_few_are_kept_and_the_oldest_goes_first(subjects, read, monkeypatch):
    monkeypatch.setattr(open_subjects, "MOST_AHEAD", 2)
    for name in NAMES:
        ahead(subjects, name)
    subjects.subject("Chen")
    subjects.subject("Anna")
    assert read == [*NAMES, "Anna"]


def test_what_cannot_be_read_is_told_to_who_comes_and_to_nobody_before(subjects):
    def broken(name):
        raise CaptureError("walk.trc: line 3 is cut off")

    subjects.read = broken
    ahead(subjects, "Ben")
    with pytest.raises(CaptureError, match="line 3"):
        subjects.subject("Ben")


def test_subjects_at_work_stay_beside_the_last_at_rest(subjects):
    opened = {name: subjects.subject(name) for name in NAMES}
    command = ("tests.addb_viewer.app.stub_sleeper",)
    opened["Anna"].jobs.start(Task("Sleeping", "starting", command, by="Zoë"))
    subjects.close_unwatched()
    assert [shared.name for shared in subjects.loaded] == ["Anna", "Chen"]


def test_of_subjects_at_rest_the_last_one_stays(subjects):
    for name in NAMES:
        subjects.subject(name)
    subjects.close_unwatched()
    assert [shared.name for shared in subjects.loaded] == ["Chen"]
