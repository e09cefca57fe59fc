"""The warm worker, with the real solver: what it answers is what a solve of the subject for the app gives."""

import shutil

import numpy as np
import pytest

from addb_viewer.app import workers
from addb_viewer.app.jobs.what_if_job import WhatIf
from addb_viewer.jobs.review_store import open_log, record
from addb_viewer.jobs.solving import computed, job_for, last_fit, resolved
from annotations.events import FlagRange
from solver.capture.subject.opened_subject import open_subject
from solver.capture.trial import read_trial
from solver.common.errors import SolverError
from solver.common.progress import silent
from solver.contact.force_review import ForceReview, as_plain
from solver.fitting.pipeline import solve
from solver.fitting.results.store import load_fit, save_fit
from solver.fitting.settings import settings_for
from solver.simulate.demo_subject import write_demo_subject
from tests.flagged import flagged

pytestmark = pytest.mark.slow  # their fixtures take long

INSTEAD = flagged((40, 60, "calcn_r", "manualReview"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two trials with forces, fitted."""
    folder = tmp_path_factory.mktemp("what_if") / "demo"
    folder.mkdir()
    write_demo_subject(folder, np.random.default_rng(1), trials=("static", "squat", "run"))
    (folder / "settings.toml").write_text("[trajectory]\nheld_out = false\n[prediction]\nenabled = false\n")
    save_fit(solve(open_subject(folder), settings_for(folder)), folder / "results")
    return folder


@pytest.fixture
def what_if(folder):
    asked = WhatIf(folder, folder / "results")
    yield asked
    asked.close()


def flag(folder, trial, start, end):
    """Somebody flags the right foot, in the log."""
    subject = open_subject(folder)
    (files,) = (each for each in subject.trials if each.name == trial)
    event = FlagRange(start, end, "manualReview", "calcn_r")
    with open_log(folder) as log:
        record(log, files, read_trial(files), event, "Zoë")


def test_it_says_what_a_solve_says_once_the_edit_is_made(folder, tmp_path):
    """With what people say of the other trials, flagged while the worker was at work already."""
    edited = tmp_path / "edited"
    shutil.copytree(folder, edited)
    kept = last_fit(job_for(edited))
    asked = workers.Asked(kept, lambda: job_for(edited))
    question = {"trial": "squat", "present": as_plain(ForceReview()), "instead": as_plain(INSTEAD)}
    asked.answer(question)
    flag(edited, "run", 60, 75)
    told = asked.answer(question)
    for side in ("present", "instead"):
        if side == "instead":
            flag(edited, "squat", 40, 60)
        fit, _ = computed(job_for(edited), last_fit(job_for(edited)), silent)
        (trial,) = (each for each in fit.trials if each.capture.name == "squat")
        residual = trial.dynamics.residual_root[trial.dynamics.used]
        for name, columns in (("force_N", slice(0, 3)), ("moment_Nm", slice(3, 6))):
            rms = np.sqrt(np.mean(np.square(residual[:, columns]).sum(axis=1)))
            assert told[side][name] == pytest.approx(rms, rel=1e-6)
        assert told[side]["frames"] == trial.dynamics.used.sum()
    assert told["present"]["frames"] - told["instead"]["frames"] == 20


def test_the_process_answers_both_sides_and_the_same_again(what_if):
    assert not what_if.is_warm
    told = what_if.ask("squat", ForceReview(), INSTEAD)
    assert what_if.is_warm
    assert told["present"]["frames"] - told["instead"]["frames"] == 20
    assert told["present"]["force_N"] > 0
    assert what_if.ask("squat", ForceReview(), INSTEAD)["instead"] == told["instead"]


def test_against_the_kept_fit_nothing_is_solved_but_what_is_asked(folder, monkeypatch):
    kept, solved = load_fit(folder / "results", folder), []

    def remembered(job, fit, **how):
        solved.append(resolved(job, fit, **how))
        return solved[-1]

    monkeypatch.setattr(workers, "resolved", remembered)
    asked = workers.Asked(kept, lambda: job_for(folder))
    told = asked.answer({"trial": "squat", "present": None, "instead": as_plain(INSTEAD)})
    then, now = (next(t for t in fit.trials if t.capture.name == "squat") for fit in (kept, *solved))
    assert told["present"] == workers.figures_of(then)
    assert told["instead"] == workers.figures_of(now)
    changes = now.dynamics.joint_torques - then.dynamics.joint_torques
    of_knee = changes[then.dynamics.used & now.dynamics.used][:, kept.skeleton.dofs.index("knee_angle_r")]
    assert told["torque"]["Nm"] >= np.abs(of_knee).max() > 0
    dof = kept.skeleton.dofs.index(told["torque"]["coordinate"])
    assert abs(changes[told["torque"]["frame"], dof]) == told["torque"]["Nm"]


def test_what_was_answered_is_not_solved_again(folder, monkeypatch):
    """Nor what the kept fit has."""
    asked_for = []

    def counted(job, fit, **how):
        asked_for.append(job)
        return resolved(job, fit, **how)

    monkeypatch.setattr(workers, "resolved", counted)
    asked = workers.Asked(load_fit(folder / "results", folder), lambda: job_for(folder))
    question = {"trial": "squat", "present": as_plain(ForceReview()), "instead": as_plain(INSTEAD)}
    first = asked.answer(question)
    assert len(asked_for) == 1
    again = asked.answer(question)
    assert len(asked_for) == 1
    assert (again["present"], again["instead"]) == (first["present"], first["instead"])


def test_where_a_solve_would_begin_anew_it_says_so(folder, tmp_path):
    changed = tmp_path / "changed"
    shutil.copytree(folder, changed)
    (changed / "settings.toml").write_text("[trajectory]\nheld_out = false\nsmoothness = 20.0\n")
    asked = WhatIf(changed, changed / "results")
    with pytest.raises(SolverError, match="have changed since the kept fit"):
        asked.ask("squat", ForceReview(), INSTEAD)
    asked.close()


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
