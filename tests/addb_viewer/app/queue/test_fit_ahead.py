"""Subjects that are fitted in the background before somebody comes to them."""

import pytest

from addb_viewer.app.jobs import fit_all
from addb_viewer.app.queue.trial_queue import TrialQueue
from addb_viewer.app.subjects.open_subjects import OpenSubjects
from addb_viewer.jobs.root_folder import open_root
from solver.fitting.results.store import has_fit
from tests.addb_viewer.app.test_app import write_subject
from tests.patience import PATIENCE_S


@pytest.fixture
def queue(tmp_path, monkeypatch):
    monkeypatch.setattr(fit_all, "WORKER", ("tests.addb_viewer.app.stub_fit_worker",))
    monkeypatch.setattr(fit_all, "LOOK_EVERY", 0.05)
    for name in ("anna", "ben", "broken", "carl", "long"):
        write_subject(tmp_path / name)
    queue = TrialQueue(OpenSubjects(open_root(tmp_path)))
    yield queue
    queue.close()


def ended(queue):
    thread = queue.fit_all._thread
    if thread is not None:
        thread.join(PATIENCE_S)
    assert not queue.fit_all.state.running


def test_the_next_two_are_fitted_and_no_more(queue, tmp_path):
    queue.fit_ahead(["ben", "carl", "anna"], "Zoë")
    assert queue.is_being_fitted("carl")
    assert not queue.is_being_fitted("anna")
    ended(queue)
    assert [has_fit(tmp_path / name / "results") for name in ("anna", "ben", "carl")] == [False, True, True]
    queue.fit_ahead(["anna"], "Zoë")
    ended(queue)
    assert has_fit(tmp_path / "anna" / "results")


def test_what_failed_or_was_cancelled_is_not_begun_again_unasked(queue):
    queue.fit_ahead(["broken"], "Zoë")
    ended(queue)
    queue.fit_ahead(["broken", "long"], "Zoë")
    assert not queue.is_being_fitted("broken")
    assert queue.is_being_fitted("long")
    queue.cancel_fits()
    ended(queue)
    queue.fit_ahead(["broken", "long"], "Zoë")
    assert not queue.fit_all.state.running
