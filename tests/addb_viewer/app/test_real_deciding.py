"""One reviewer at two real walks: what keys decide, and that they decide nothing else."""

import numpy as np
import pytest

from addb_viewer.jobs.solving import job_for, solved
from addb_viewer.jobs.stored_solves import stored_solves
from annotations.events import Status
from solver.fitting.results.store import load_fit

pytestmark = [pytest.mark.real, pytest.mark.timeout(900)]

FEET = ("calcn_r", "calcn_l")
FIRST, SECOND = (0, 25), (8, 76)  # what detection proposes in `part1`: right, left


@pytest.fixture
def zoe(walks_app, enter):
    """At the first trial."""
    browser = enter(walks_app, at="part1")
    assert browser.session.shown == "part1"
    assert [(p.proposal.start, p.proposal.end) for p in browser.session.review.proposals] == [FIRST, SECOND]
    return browser


def select(browser, start, end):
    browser.go_to("")
    browser.go_to(f"{start}:{end}")
    browser.until(lambda: browser.session.review.chosen == (start, end), f"frames {start} to {end - 1}")


def test_accepting_one_proposal_leaves_the_others_as_detection_has_them(walks_folder, zoe, walks_review):
    before = load_fit(walks_folder / "results", walks_folder)
    zoe.press("Next proposal or flagged range")
    zoe.until(lambda: zoe.session.review.chosen == FIRST)
    zoe.press("Accept the proposal")
    zoe.until(lambda: [p.start for p in walks_review().accepted] == [FIRST[0]])
    again = solved(job_for(walks_folder)).fit
    for trial, was in zip(again.trials, before.trials, strict=True):
        np.testing.assert_array_equal(trial.mask.counts, was.mask.counts, err_msg=trial.capture.name)


def test_finishing_with_undecided_proposals_says_so_and_they_stay_left_out(walks_folder, zoe, walks_review):
    before = load_fit(walks_folder / "results", walks_folder)
    zoe.press("Finish the trial, go to the next")
    zoe.until(lambda: zoe.asked("0–24 right; 8–75 left. It stays left out."), "what speaks against it")
    assert walks_review().status is Status.UNSEEN
    zoe.press("Finish the trial, go to the next")
    zoe.until(lambda: walks_review().status is Status.FINISHED)
    again = solved(job_for(walks_folder)).fit
    for trial, was in zip(again.trials, before.trials, strict=True):
        np.testing.assert_array_equal(trial.mask.counts, was.mask.counts, err_msg=trial.capture.name)


def test_finishing_names_only_the_frames_that_nobody_has_decided_about(zoe, walks_review):
    select(zoe, FIRST[0], FIRST[1] - 2)
    zoe.press("Clear: the force counts")
    zoe.until(lambda: walks_review().cleared)
    zoe.press("Finish the trial, go to the next")
    zoe.until(lambda: zoe.asked("leaves out: 23–24 right; 23–75 left. It stays left out."), "the words")


@pytest.mark.slow
def test_t_while_a_worse_solve_waits_says_that_it_will_be_discarded(walks_folder, zoe, walks_review):
    """The left foot stepped off the plate: that its force counts leaves hundreds of newtons unexplained."""
    before = load_fit(walks_folder / "results", walks_folder).trials[0]
    select(zoe, *SECOND)
    zoe.press("Clear: the force counts")
    zoe.until(lambda: walks_review().cleared)
    zoe.press("Solve again")
    zoe.until(lambda: zoe.told("The new solve is on the screen"), "the solve")
    zoe.press("Finish the trial, go to the next")
    zoe.until(lambda: zoe.asked("Your new solve is worse (residual force "), "the words")
    zoe.until(lambda: zoe.asked("it is discarded. Shift+Enter keeps it"), "its default")
    assert walks_review().status is Status.IN_WORK
    zoe.press("Finish the trial, go to the next")
    zoe.until(lambda: walks_review().status is Status.FINISHED)
    assert [s.state for s in stored_solves(walks_folder / "results") if s.by == "Zoë"] == ["discarded"]
    kept = load_fit(walks_folder / "results", walks_folder).trials[0]
    np.testing.assert_array_equal(kept.mask.counts, before.mask.counts)
