"""The warm worker, with the real solver: what it answers is what a solve of the trial would give."""

from dataclasses import replace

import numpy as np
import pytest

from addb_viewer.app.jobs.what_if import WhatIf
from addb_viewer.app.workers import what_if as what_if_worker
from solver.capture.subject import open_subject
from solver.contact.force_review import ForceReview, as_plain
from solver.errors import SolverError
from solver.pipeline import resolve, solve
from solver.results.store import load_fit, save_fit
from solver.settings import Settings
from solver.simulate.demo import write_demo_subject
from tests.flagged import flagged


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("what_if") / "demo"
    folder.mkdir()
    write_demo_subject(folder, np.random.default_rng(1), trials=("static", "squat"))
    save_fit(solve(open_subject(folder), Settings()), folder / "results")
    return folder


@pytest.fixture
def what_if(folder):
    asked = WhatIf(folder, folder / "results")
    yield asked
    asked.close()


def test_it_answers_both_sides_and_the_same_again(what_if, folder):
    instead = flagged((40, 60, "calcn_r", "manualReview"))
    told = what_if.ask("squat", ForceReview(), instead)
    fit = load_fit(folder / "results", folder)
    for side, flags in (("present", ForceReview()), ("instead", instead)):
        trial = resolve(replace(fit), {"squat": flags}, Settings()).trials[0]
        force = np.linalg.norm(trial.dynamics.residual_root[trial.dynamics.used, :3], axis=1)
        assert told[side]["force_N"] == pytest.approx(np.sqrt(np.mean(force**2)), rel=1e-6)
        assert told[side]["frames"] == trial.dynamics.used.sum()
    assert told["present"]["frames"] - told["instead"]["frames"] == 20
    assert what_if.ask("squat", ForceReview(), instead)["instead"] == told["instead"]


def test_what_was_answered_is_not_solved_again(folder, monkeypatch):
    solved = []

    def counted(*arguments, **options):
        solved.append(arguments)
        return resolve(*arguments, **options)

    monkeypatch.setattr(what_if_worker, "resolve", counted)
    asked = what_if_worker.Asked(load_fit(folder / "results", folder), Settings(), None)
    instead = as_plain(flagged((40, 60, "calcn_r", "manualReview")))
    question = {"trial": "squat", "present": as_plain(ForceReview()), "instead": instead}
    first = asked.answer(question)
    assert len(solved) == 2
    again = asked.answer(question)
    assert len(solved) == 2
    assert (again["present"], again["instead"]) == (first["present"], first["instead"])


def test_what_cannot_be_asked_is_one_clear_error_and_the_worker_lives_on(what_if):
    with pytest.raises(SolverError, match="flagged, but the trial has"):
        what_if.ask("squat", ForceReview(), flagged((0, 10**6, None, "manualReview")))
    assert what_if.ask("squat", ForceReview(), ForceReview())["present"]["frames"] > 0


def test_without_a_fit_it_says_so(tmp_path):
    write_demo_subject(tmp_path, np.random.default_rng(1), trials=("static",))
    asked = WhatIf(tmp_path, tmp_path / "results")
    with pytest.raises(SolverError, match="fit"):
        asked.ask("static", ForceReview(), ForceReview())
    asked.close()
