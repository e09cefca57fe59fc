"""Two people solve one subject: every solve has its turn, nobody's is thrown away unasked, the first kept."""

import json
import shutil
from dataclasses import replace

import pytest

from addb_viewer.app.app import ReviewApp
from addb_viewer.app.queue.trial_queue import TrialQueue
from addb_viewer.app.security.server import open_server
from addb_viewer.app.subjects import shared_subject
from addb_viewer.app.subjects.library import library_of
from addb_viewer.app.subjects.open_subjects import OpenSubjects
from addb_viewer.jobs.root_folder import RootFolder
from addb_viewer.jobs.stored_solves import DISCARDED, KEPT, NEW, stored_solves, waiting_solves
from solver.fitting.results.store import has_fit, save_fit

SOLVER = """
import pathlib, sys, time
from addb_viewer.jobs.stored_solves import add
from solver.fitting.results.store import load_fit
folder, results, author = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3]
while not (folder.parent / "go").exists():
    time.sleep(0.02)
print(add(load_fit(folder.parent / "template", folder), results, by=author, seconds=1.0))
"""


@pytest.fixture
def subject(small_fit, monkeypatch):
    """A subject whose solver gives a copy of a fit, as soon as the file `go` is beside its folder."""
    folder = small_fit.subject.folder
    folder.mkdir()
    (folder.parent / "synthetic_solver.py").write_text(SOLVER)
    save_fit(replace(small_fit, mass_kg=90.0), folder.parent / "template")
    monkeypatch.setenv("PYTHONPATH", str(folder.parent))
    monkeypatch.setattr(shared_subject, "SOLVE_WORKER", ("synthetic_solver",))
    return small_fit.subject


@pytest.fixture
def open_app(subject):
    apps = []

    def opened():
        apps.append(ReviewApp(open_server(port=0), TrialQueue.of(library_of(subject))))
        return apps[-1]

    yield opened
    for app in apps:
        app.close()


def states(subject):
    return [(solve.by, solve.state) for solve in stored_solves(subject.folder / "results")]


def test_a_second_solve_waits_its_turn_and_then_for_the_decision_about_the_first(
    subject, small_fit, open_app, enter
):
    save_fit(small_fit, subject.folder / "results")
    app = open_app()
    zoe, bo = enter(app), enter(app, name="Bo", at="walk")
    zoe.press("Solve again")
    bo.until(lambda: "Solving for Zoë" in bo.html(), "the banner")
    bo.press("Solve again")
    bo.until(lambda: bo.told("It waits its turn Solving begins by itself after: Solving for Zoë"))
    zoe.until(lambda: "; then Solving for Bo." in zoe.html(), "the banner")
    (subject.folder.parent / "go").touch()
    zoe.until(lambda: states(subject) == [("Zoë", NEW), ("Bo", NEW)], "both")
    bo.until(lambda: bo.told("The solve for Bo waits until Zoë's is kept or discarded"))
    assert app.subjects.loaded[0].fits.new.by == "Zoë"
    zoe.until(lambda: "new solve of Zoë, new solve of Bo" in lines(app, ""), "the queue")

    bo.press("Discard the new solve")
    bo.until(lambda: bo.asked("Discard Zoë's solve 1?"))
    bo.press("No, to the question")
    bo.until(lambda: not bo.questions)
    assert states(subject) == [("Zoë", NEW), ("Bo", NEW)]
    bo.press("Discard the new solve")
    bo.until(lambda: bo.questions)
    bo.press("Yes, to the question")
    zoe.until(lambda: zoe.told("Bo has discarded your solve 1"))
    bo.until(
        lambda: app.subjects.loaded[0].fits.new is not None and app.subjects.loaded[0].fits.new.by == "Bo",
        "Bo's own",
    )
    assert states(subject) == [("Zoë", DISCARDED), ("Bo", NEW)]
    zoe.until(lambda: "discarded (decided by Bo)" in zoe.html(), "the list")
    zoe.press("Keep the new solve (so does Y)")
    bo.until(lambda: bo.told("Zoë has kept your solve 2"))
    bo.until(lambda: ("Bo", KEPT) in states(subject))
    bo.until(lambda: "· for Bo" not in bo.html(), "the banner")


def test_ones_own_newer_solve_takes_the_place_of_ones_own(subject, small_fit, open_app, enter):
    save_fit(small_fit, subject.folder / "results")
    zoe = enter(app := open_app())
    (subject.folder.parent / "go").touch()
    shared = app.subjects.loaded[0]
    for number in (1, 2):
        zoe.press("Solve again")
        zoe.until(
            lambda number=number: shared.fits.new is not None and shared.fits.new.number == number,
            "the solve",
        )
    zoe.until(lambda: states(subject) == [("Zoë", DISCARDED), ("Zoë", NEW)], "the list")


def test_what_waits_is_there_again_after_a_restart_in_the_same_order(subject, small_fit, open_app, enter):
    save_fit(small_fit, subject.folder / "results")
    (subject.folder.parent / "go").touch()
    app = open_app()
    for name in ("Zoë", "Bo"):
        browser = enter(app, name=name, at="walk")
        browser.press("Solve again")
        browser.until(lambda browser=browser: any(title == "Solved" for title, _ in browser.notices))
    app.close()
    shared = open_app().subjects.loaded[0]
    assert (shared.fits.new.by, [solve.by for solve in shared.fits.behind]) == ("Zoë", ["Bo"])
    assert [s.by for s in waiting_solves(stored_solves(shared.results))] == ["Zoë", "Bo"]


def test_the_first_fit_is_kept_without_asking_and_told(subject, open_app, enter):
    app = open_app()
    zoe, bo = enter(app, trial=False), enter(app, trial=False, name="Bo", at="walk")
    bo.until(lambda: bo.bar["verdict"]["next"] == ["solve", "fit"], "the head")
    zoe.press("Solve again")
    zoe.until(lambda: "Solving for Zoë" in zoe.html(), "the banner")
    (subject.folder.parent / "go").touch()
    for browser in (zoe, bo):
        browser.until(lambda browser=browser: browser.told("The subject's first fit is kept"), "the word")
        browser.until(lambda browser=browser: "Not fitted" not in browser.verdict, "the head")
    assert states(subject) == [("Zoë", KEPT)]
    assert has_fit(subject.folder / "results")
    assert app.subjects.loaded[0].fits.new is None
    assert not bo.told("A fit of this subject has come")


def test_the_queue_notices_what_a_terminal_does_to_other_subjects(tmp_path, small_fit, enter):
    root = tmp_path / "root"
    subjects = {}
    for name in ("S1", "S2"):
        subjects[name] = replace(small_fit.subject, folder=root / name)
        (root / name).mkdir(parents=True)
        save_fit(small_fit, root / name / "results")
    shutil.rmtree(root / "S2" / "results")
    subjects_of_root = OpenSubjects(RootFolder(root, ("S1", "S2")))
    subjects_of_root.read = lambda name: subjects[name]
    app = ReviewApp(open_server(port=0), TrialQueue(subjects_of_root), "S1")
    try:
        zoe = enter(app, trial=False)
        zoe.until(lambda: "Not fitted" in lines(app, "S2"), "the row")
        save_fit(small_fit, root / "S2" / "results")  # as `addb-viewer fit` does
        zoe.until(lambda: "Not fitted" not in lines(app, "S2"), "the figures")
        made = root / "S2" / "results" / "solves" / "1"
        save_fit(small_fit, made)
        told = {"by": "Eve", "when": "2026-01-01T00:00:00+00:00", "seconds": 1.0, "state": NEW}
        (made / "made.json").write_text(json.dumps(told))
        zoe.until(lambda: "new solve of Eve" in lines(app, "S2"), "the solve that waits")
    finally:
        app.close()


def lines(app, subject):
    return " ".join(row.verdict.line.text for row in app.queue.rows() if subject in row.subject)
