"""The queue shows what other programs record of subjects that nobody has open, in files or a database."""

import pytest

from addb_viewer.app.queue.trial_queue import TrialQueue, signature
from addb_viewer.app.subjects.open_subjects import OpenSubjects
from addb_viewer.jobs import review_store
from addb_viewer.jobs.environment import ROOT, STORE
from addb_viewer.jobs.review_store import open_log
from addb_viewer.jobs.root_folder import RootFolder
from annotations.events import FlagRange, Status
from tests.annotations.postgresql_server import postgresql  # noqa: F401 (a fixture)


@pytest.fixture(params=["files", "postgresql"])
def store(request, monkeypatch):
    """Where reviews lie."""
    url = "" if request.param == "files" else request.getfixturevalue("postgresql").new_place()
    monkeypatch.setenv(STORE, url)
    monkeypatch.delenv(ROOT, raising=False)
    yield url
    review_store._shared.cache_clear()


@pytest.fixture
def trials(store, tmp_path):
    for name in ("S1", "S2"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "walk.trc").write_text("markers")
        (tmp_path / name / "subject.toml").write_text('[trials.walk]\nmarkers = "walk.trc"\n')
    built = TrialQueue(OpenSubjects(RootFolder(tmp_path, ("S1", "S2"))))
    yield built
    built.close()


def test_an_edit_of_an_unopened_subject_by_another_program_shows_by_itself(trials, tmp_path, until):
    assert {row.status for row in trials.rows()} == {Status.UNSEEN}
    trials.watch()
    with open_log(tmp_path / "S2") as log:
        log.append("walk", FlagRange(1, 3, "notOverForcePlate", "calcn_r"), "anna")
    until(lambda: {row.subject: row.status for row in trials.rows()}["S2"] is Status.IN_WORK, "the row")
    assert {row.subject: row.status for row in trials.rows()}["S1"] is Status.UNSEEN


def test_nothing_is_read_again_where_nothing_changed(trials, tmp_path):
    with open_log(tmp_path / "S1") as log:
        log.append("walk", FlagRange(1, 3, "notOverForcePlate", "calcn_r"), "anna")

    def seen(name):
        return signature(tmp_path / name, tmp_path / name / "results", review=True)

    before = {name: seen(name) for name in ("S1", "S2")}
    assert {name: seen(name) for name in ("S1", "S2")} == before
    with open_log(tmp_path / "S2") as log:
        log.append("walk", FlagRange(1, 3, "notOverForcePlate", "calcn_r"), "anna")
    assert seen("S1") == before["S1"]
    assert seen("S2") != before["S2"]
