"""All subjects without a fit: failures are told, people's work goes first, cancelling is clean."""

import threading

import pytest

from addb_viewer.app.jobs import fit_all
from addb_viewer.app.jobs.fit_all import FitAll, Fitting
from addb_viewer.app.queue.page_channel import batch_words
from addb_viewer.app.queue.queue_html import words_of_rows
from addb_viewer.app.shell.bar import work_json
from tests.patience import PATIENCE_S

SPITEFUL = "<script>alert(1)</script>"


@pytest.fixture(autouse=True)
def stub(monkeypatch):
    monkeypatch.setattr(fit_all, "WORKER", ("tests.addb_viewer.app.stub_fit_worker",))
    monkeypatch.setattr(fit_all, "LOOK_EVERY", 0.05)


@pytest.fixture
def fits(tmp_path):
    """The list; what people do is in `wanted` and `taken`, the subjects that ended in `ended`."""

    class All(FitAll):
        def __init__(self):
            self.wanted, self.taken, self.ended, self.states = set(), set(), [], []
            super().__init__(
                lambda name: (tmp_path / name, tmp_path / name / "results"),
                lambda: bool(self.wanted),
                lambda name: name in self.taken,
                self.noted,
            )

        def noted(self, name):
            self.states.append(self.state)
            self.ended += [name] if name else []

        def join(self):
            thread = self._thread
            if thread is not None:
                thread.join(PATIENCE_S)
            assert not self.state.running

    for name in ("anna", "ben", "broken", "carl", "long", "old"):
        (tmp_path / name).mkdir()
    made = All()
    yield made
    made.close()


def wait_for(condition):
    event = threading.Event()
    for _ in range(round(PATIENCE_S / 0.02)):
        if condition():
            return
        event.wait(0.02)
    pytest.fail("waited in vain")


def test_one_after_another_and_what_fails_stops_none(fits, tmp_path):
    assert fits.start(["anna", "broken", "carl"], "Zoë") == 3
    fits.join()
    assert fits.ended == ["anna", "broken", "carl"]
    state = fits.state
    assert (state.fitted, state.total) == (2, 3)
    assert state.failures["broken"] == "walk.trc: the markers end within a line"
    assert (tmp_path / "carl" / "results" / "fit.json").is_file()
    assert all(
        bool(s.subject) + len(s.waiting) + s.fitted + len(s.failures) == 3 for s in fits.states if s.running
    )


def test_what_came_with_a_warning_is_told_and_counts(fits):
    fits.start(["anna", "old"], "Zoë")
    fits.join()
    assert (fits.state.fitted, dict(fits.state.failures)) == (2, {})
    assert dict(fits.state.warnings) == {"old": "the kept fit is out of date (walk.trc)"}
    (told,) = batch_words({"export": fits.state}).values()
    assert told["warnings"] == dict(fits.state.warnings)


def test_people_go_first(fits):
    fits.wanted.add("a solve")
    fits.start(["anna"], "Zoë")
    wait_for(lambda: fits.state.held_up)
    assert fits.state.subject == ""
    fits.wanted.clear()
    fits.join()
    assert fits.state.fitted == 1


def test_a_subject_that_somebody_solves_is_left_to_them(fits, tmp_path):
    fits.start(["long", "anna"], "Zoë")
    wait_for(lambda: fits.state.subject == "long")
    fits.taken.add("long")
    fits.join()
    assert (fits.state.fitted, dict(fits.state.failures)) == (1, {})
    assert not (tmp_path / "long" / "results").exists()


def test_cancelling_leaves_nothing_half_done_and_starting_goes_on(fits, tmp_path):
    fits.start(["anna", "long", "ben"], "Zoë")
    wait_for(lambda: fits.state.subject == "long")
    fits.cancel()
    assert fits.start(["ben"], "Bo") == 1
    fits.join()
    assert fits.state.by == "Bo"
    assert [(tmp_path / name / "results").exists() for name in ("anna", "long", "ben")] == [True, False, True]


def test_asking_twice_is_asking_once_and_a_failure_is_tried_again(fits):
    fits.wanted.add("a solve")
    assert fits.start(["broken", "anna"], "Zoë") == 2
    assert fits.start(["broken", "anna"], "Bo") == 0
    fits.wanted.clear()
    fits.join()
    assert list(fits.state.failures) == ["broken"]
    assert fits.start(["broken"], "Zoë") == 1
    fits.join()
    assert list(fits.state.failures) == ["broken"]
    assert fits.state.total == 1


def test_the_time_left_is_that_of_the_others():
    """Two and a half subjects in 100 s: the one and a half that are left take 60 s."""
    state = Fitting(running=True, subject="c", fraction=0.5, waiting=("d",), fitted=2, seconds=100.0)
    assert state.seconds_left == pytest.approx(60.0)
    assert Fitting(running=True, subject="c", waiting=("d",)).seconds_left is None
    (told,) = work_json(None, state)
    assert told["text"] == "Fitted 2 of 4 that had no fit, about 60 s left."


def test_names_and_reasons_stay_text():
    state = Fitting(running=True, by=SPITEFUL, subject="a", stage=SPITEFUL, failures={"b": SPITEFUL})
    assert "<script>" not in "".join(words_of_rows(state).values())


def test_other_work_has_its_own_command_and_goes_to_subjects_that_have_a_fit(tmp_path):
    (tmp_path / "anna" / "results").mkdir(parents=True)
    (tmp_path / "anna" / "results" / "fit.json").write_text("{}")
    work = FitAll(
        lambda name: (tmp_path / name, tmp_path / name / "results"),
        lambda: False,
        lambda name: False,
        lambda name: None,
        lambda folder, results: ("tests.addb_viewer.app.stub_told_worker", str(results), folder.name),
    )
    work.start(["anna"], "Zoë")
    thread = work._thread
    if thread is not None:
        thread.join(PATIENCE_S)
    assert (work.state.fitted, dict(work.state.failures)) == (1, {})
    assert (tmp_path / "anna" / "results" / "told").read_text() == "anna"
