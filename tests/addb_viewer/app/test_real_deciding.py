"""One reviewer at two real walks: what keys decide, and that they decide nothing else."""

import contextlib
import shutil
import sqlite3

import numpy as np
import pytest

from addb_viewer.app.app import start
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
    browser.put("Go to", "")
    browser.put("Go to", f"{start}:{end}")
    browser.until(lambda: browser.session.review.chosen == (start, end), f"frames {start} to {end - 1}")


def go(browser, frame):
    browser.put("Go to", "")
    browser.put("Go to", f"{frame}")
    browser.until(lambda: browser.session.frame == frame, f"frame {frame}")


def flags(review):
    return [(f.start, f.end, f.foot, f.reason) for f in review.flags]


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
    zoe.until(lambda: zoe.told("0–24 right; 8–75 left. It stays left out."), "what speaks against it")
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
    zoe.until(lambda: zoe.told("leaves out: 23–24 right; 23–75 left. It stays left out."), "the words")


def test_the_next_t_says_that_nothing_was_looked_at_and_u_takes_the_first_one_back(zoe, walks_review):
    zoe.finish("It stays left out")
    zoe.until(lambda: zoe.session.shown == "part2")
    zoe.press("Finish the trial, go to the next")
    zoe.until(lambda: zoe.told("you have not looked at it"), "the words")
    zoe.press("Undo")
    zoe.until(lambda: zoe.session.shown == "part1")
    zoe.until(lambda: walks_review().status is Status.UNSEEN)
    assert walks_review("part2").status is Status.UNSEEN


def test_u_on_the_next_page_takes_the_finishing_back(zoe, walks_review):
    zoe.finish()
    zoe.until(lambda: zoe.session.shown == "part2")
    assert walks_review().status is Status.FINISHED
    zoe.press("Undo")
    zoe.until(lambda: walks_review().status is Status.UNSEEN, "the finishing to be taken back")
    zoe.until(lambda: zoe.session.shown == "part1")


def test_t_obeys_the_queues_filter(zoe, walks_review):
    zoe.put("Filter", "part1")
    zoe.until(lambda: ">part2<" not in zoe.html(), "the filter")
    zoe.finish()
    zoe.until(lambda: walks_review().status is Status.FINISHED)
    zoe.until(lambda: zoe.told("1 trial waits outside"))
    assert zoe.session.shown == "part1"


def test_t_in_a_trial_without_a_fit_says_so(walks_folder, enter, walks_review):
    shutil.rmtree(walks_folder / "results")
    app = start(walks_folder, port=0)
    try:
        zoe = enter(app, at="part1")
        zoe.press("Finish the trial, go to the next")
        zoe.until(lambda: zoe.told("Nothing has been fitted to this trial yet"), "the words")
        assert walks_review().status is Status.UNSEEN
        zoe.press("Finish the trial, go to the next")
        zoe.until(lambda: zoe.told("Next: part2. Nothing is fitted to it yet. G fits it."))
    finally:
        app.close()


@pytest.mark.slow
def test_t_while_a_solve_waits_says_that_it_will_be_kept(walks_folder, zoe, walks_review):
    select(zoe, *SECOND)
    zoe.press("Clear: the force counts")
    zoe.until(lambda: walks_review().cleared)
    zoe.press("Solve again")
    zoe.until(lambda: zoe.told("The new solve is on the screen"), "the solve")
    zoe.press("Finish the trial, go to the next")
    zoe.until(lambda: zoe.told("Your new solve waits"), "the words")
    zoe.until(lambda: zoe.told("N of residual force): it is kept"), "its default")
    assert walks_review().status is Status.IN_WORK
    zoe.press("Finish the trial, go to the next")
    zoe.until(lambda: walks_review().status is Status.FINISHED)
    assert [solve.state for solve in stored_solves(walks_folder / "results") if solve.by == "Zoë"] == ["kept"]
    left = load_fit(walks_folder / "results", walks_folder).trials[0].mask.counts[:, FEET.index("calcn_l")]
    assert left[slice(*SECOND)].all(), "the solve that was kept is the one with the decision"


def test_escape_and_a_click_elsewhere_drop_the_selection_so_that_the_next_key_is_about_the_contact(
    zoe, walks_review
):
    select(zoe, 30, 40)
    zoe.press("No, to the question")  # Esc
    zoe.until(lambda: zoe.session.review.chosen is None, "Esc")
    select(zoe, 30, 40)
    go(zoe, 50)  # a click on the timeline
    zoe.until(lambda: zoe.session.review.chosen is None, "the click")
    zoe.press("Flag: force wrong")
    zoe.until(lambda: flags(walks_review()))
    assert all(start <= 50 < end and (start, end) != (30, 40) for start, end, *_ in flags(walks_review()))


def test_f_is_about_one_trial(zoe, walks_review):
    zoe.press("Foot: right, left, both")
    zoe.until(lambda: zoe.session.review.about == "calcn_r")
    zoe.put("Trial", "part2")
    zoe.until(lambda: zoe.session.shown == "part2" and zoe.field("Foot")["value"] == "both", "both feet")
    select(zoe, 10, 20)
    zoe.press("Flag: force wrong")
    zoe.until(lambda: flags(walks_review("part2")) == [(10, 20, None, "forceDiscrepancy")])


def test_backspace_rejects_nothing_but_what_the_line_above_says(zoe, walks_review):
    select(zoe, 30, 40)  # inside a proposal, which is about other frames
    zoe.until(lambda: "<b>Frames 30 to 39</b>" in zoe.html(), "the line")
    zoe.press("Reject the proposal")
    zoe.until(lambda: zoe.told("no open proposal on the selected frames"), "the refusal")
    assert not walks_review().rejected


def test_i_then_o_earlier_selects_both(zoe, walks_review):
    go(zoe, 50)
    zoe.press("Start of a range")
    go(zoe, 20)
    zoe.press("End of a range")
    zoe.until(lambda: zoe.session.review.chosen == (20, 51), "both borders")
    zoe.press("Flag: force wrong")
    zoe.until(lambda: flags(walks_review()) == [(20, 51, None, "forceDiscrepancy")])


def test_what_u_took_back_is_selected_and_can_be_decided_otherwise(zoe, walks_review):
    select(zoe, 30, 40)
    zoe.press("Flag: force wrong")
    zoe.until(lambda: flags(walks_review()))
    go(zoe, 90)
    zoe.press("Undo")
    zoe.until(lambda: zoe.session.review.chosen == (30, 40), "the range")
    zoe.press("Flag: markers bad")
    zoe.until(lambda: flags(walks_review()) == [(30, 40, None, "tooHighMarkerRMS")])


def test_an_edit_that_fails_keeps_its_note(walks_folder, zoe, walks_review):
    select(zoe, 10, 20)
    zoe.press("Flag: force wrong")
    zoe.until(lambda: walks_review().flags)
    zoe.put("Note", "seen on video")
    select(zoe, 30, 40)
    with other_program(walks_folder) as database:
        database.execute("CREATE TRIGGER no BEFORE INSERT ON edits BEGIN SELECT RAISE(ABORT, 'not now'); END")
    zoe.press("Flag: force wrong")
    zoe.until(lambda: zoe.told("Flag: force wrong failed"), "the failure")
    assert zoe.session.review.panel.note.value == "seen on video"
    with other_program(walks_folder) as database:
        database.execute("DROP TRIGGER no")
    zoe.press("Flag: force wrong")
    zoe.until(lambda: [flag.note for flag in walks_review().flags] == ["", "seen on video"])
    zoe.until(lambda: zoe.session.review.panel.note.value == "", "an empty box")


def other_program(walks_folder):
    """A connection of its own to the review, closed after use."""
    return contextlib.closing(sqlite3.connect(walks_folder / "annotations.sqlite", isolation_level=None))
