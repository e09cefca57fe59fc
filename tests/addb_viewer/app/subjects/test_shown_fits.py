"""A fit made in a terminal while the app is open is noticed, shown and told."""

import threading
from dataclasses import replace
from functools import partial

import pytest

from addb_viewer.app.subjects import shown_fits
from addb_viewer.app.subjects.library import library_of
from addb_viewer.app.subjects.shared_subject import SharedSubject
from addb_viewer.app.subjects.shown_fits import FitWatch
from addb_viewer.jobs.stored_solves import add
from solver.fitting.results.store import save_fit
from tests.patience import PATIENCE_S

SOON = 0.02  # [s]


class Told:
    """A listener that remembers."""

    def __init__(self):
        self.said, self.heard = [], threading.Event()

    def edited(self, edits): ...
    def progressed(self, progress): ...
    def ended(self, task, outcome): ...

    def fit_changed(self):
        self.said.append("another fit")

    def failed(self, doing, error):
        self.told(doing, str(error))

    def told(self, title, body):
        self.said.append(f"{title}: {body}")
        self.heard.set()


@pytest.fixture
def shared(small_fit, monkeypatch):
    monkeypatch.setattr(shown_fits, "FitWatch", partial(FitWatch, every=SOON))
    folder = small_fit.subject.folder
    save_fit(small_fit, folder / "results")
    subjects = []

    def opened():
        subjects.append(SharedSubject(".", library_of(small_fit.subject)))
        subjects[-1].add_listener(listener := Told())
        return subjects[-1], listener

    yield opened
    for shared in subjects:
        shared.close()


def test_another_programs_fit_is_put_on_the_screen(shared, small_fit):
    opened, listener = shared()
    save_fit(replace(small_fit, mass_kg=77.0), opened.results)
    assert listener.heard.wait(PATIENCE_S)
    assert opened.fits.shown.fit.mass_kg == 77.0
    assert listener.said == ["another fit", listener.said[1]]
    assert "A fit of this subject has come" in listener.said[1]


def test_a_new_solve_that_waits_stays_on_the_screen(shared, small_fit):
    add(replace(small_fit, mass_kg=90.0), small_fit.subject.folder / "results", by="Zoë", seconds=1.0)
    opened, listener = shared()
    save_fit(replace(small_fit, mass_kg=77.0), opened.results)
    assert listener.heard.wait(PATIENCE_S)
    assert opened.fits.shown.fit.mass_kg == 90.0
    assert "Discard" in listener.said[-1]
    opened.discard("Zoë")
    assert opened.fits.shown.fit.mass_kg == 77.0


def test_half_a_fit_is_told_and_the_present_one_stays(shared, small_fit):
    opened, listener = shared()
    (opened.results / "fit.json").write_text('{"format": 1, "solve": "solve-9"}')
    assert listener.heard.wait(PATIENCE_S)
    assert "format 1" in listener.said[-1]
    assert opened.fits.shown.fit.mass_kg == 100.0


def test_keeping_a_solve_is_no_news(shared, small_fit):
    add(replace(small_fit, mass_kg=90.0), small_fit.subject.folder / "results", by="Zoë", seconds=1.0)
    opened, listener = shared()
    opened.keep("Zoë")
    assert not listener.heard.wait(10 * SOON)


def test_what_the_app_writes_slowly_is_no_news(tmp_path):
    """Looked at in the middle of it, too."""
    changed = threading.Event()
    watch = FitWatch(tmp_path, changed.set, SOON)
    with watch.own_fit():
        (tmp_path / "fit.json").write_text("{}")
        assert not changed.wait(5 * SOON)
    assert not changed.wait(5 * SOON)
    watch.close()


def test_what_does_not_change_or_goes_away_is_no_news(tmp_path):
    (tmp_path / "fit.json").write_text("{}")
    changed = threading.Event()
    watch = FitWatch(tmp_path, changed.set, SOON)
    assert not changed.wait(5 * SOON)
    (tmp_path / "fit.json").unlink()
    assert not changed.wait(5 * SOON)
    (tmp_path / "fit.json").write_text("{}")
    assert changed.wait(PATIENCE_S)
    watch.close()
