"""Two people at one app: who is where, who is told, and what is asked."""

import pytest

from addb_viewer.jobs.review_store import open_log
from annotations.events import FlagRange, Status


@pytest.fixture
def app(tmp_path, make_replay, make_app):
    app = make_app(tmp_path, [make_replay(), make_replay("run", 180), make_replay("jump", 170)])
    yield app
    app.close()


def paint(browser, frames, label):
    """A range, after all that was asked before has been done."""
    start, end = frames
    browser.go_to(f"{start}:{end}")
    browser.until(lambda: browser.session.review.chosen == (start, end), frames)
    browser.press(label)


def test_everybody_begins_at_a_trial_of_their_own_and_sees_who_is_where(app, enter):
    zoe, bo = enter(app), enter(app, name="Bo")
    assert (zoe.session.shown, bo.session.shown) == ("walk", "run")
    for browser, there in ((zoe, "Bo"), (bo, "Zoë")):
        browser.press("Choose a trial")
        browser.until(
            lambda browser=browser, there=there: browser.asked(f"<div>{there} is here</div>"), "the list"
        )
        browser.press("No, to the question")
    assert "on this trial too" not in zoe.html()
    bo.open_trial("walk")
    zoe.until(lambda: "Bo is on this trial too" in zoe.html())
    bo.until(lambda: "Zoë is on this trial too" in bo.html())
    bo.close()
    zoe.until(lambda: "Bo is" not in zoe.html())


def test_the_next_trial_is_offered_to_one_person_only(app, enter, stored):
    zoe, bo = enter(app), enter(app, name="Bo")
    zoe.finish()
    zoe.until(lambda: zoe.session.shown == "jump")
    bo.finish()
    bo.until(lambda: bo.asked("Zoë on jump"))
    assert bo.session.shown == "run"
    assert stored("run").status is Status.FINISHED
    assert stored("jump").status is Status.UNSEEN
    zoe.finish()
    zoe.until(lambda: zoe.asked("Every trial has been reviewed"))


def test_both_hear_of_a_disagreement_wherever_they_are_and_once(app, enter):
    zoe, bo = enter(app), enter(app, name="Bo", at="walk")
    paint(zoe, (30, 50), "Flag: moment wrong")
    bo.until(lambda: "30–49" in bo.html())
    zoe.open_trial("run")
    zoe.until(lambda: zoe.session.shown == "run")
    paint(bo, (40, 60), "Flag: force wrong")
    bo.until(lambda: bo.told("You and Zoë disagree walk, frames 40 to 49"))
    zoe.until(lambda: zoe.told("You and Bo disagree walk, frames 40 to 49"))
    paint(bo, (70, 80), "Flag: force wrong")
    bo.until(lambda: "70–79" in bo.html())
    assert sum("disagree" in title for title, _ in (*zoe.notices, *bo.notices)) == 2


def test_a_disagreement_that_another_program_records_is_heard_too(app, enter, tmp_path):
    zoe = enter(app)
    paint(zoe, (30, 50), "Flag: moment wrong")
    zoe.until(lambda: "30–49" in zoe.html())
    with open_log(tmp_path) as log:
        log.append("walk", FlagRange(45, 46, "forceDiscrepancy"), "Eve")
    zoe.until(lambda: zoe.told("You and Eve disagree"))


def test_t_says_a_disagreement_first_and_esc_forgets_that_it_did(app, enter, stored):
    zoe, bo = enter(app), enter(app, name="Bo", at="walk")
    paint(zoe, (30, 50), "Flag: moment wrong")
    bo.until(lambda: "30–49" in bo.html())
    paint(bo, (40, 60), "Clear: the force counts")
    zoe.until(lambda: zoe.told("You and Bo disagree"))
    zoe.press("Finish the trial, go to the next")
    zoe.until(lambda: zoe.asked("Bo says"))
    zoe.press("No, to the question")  # Esc: T asks again
    zoe.until(lambda: not zoe.questions)
    zoe.press("Finish the trial, go to the next")
    zoe.until(lambda: zoe.asked("Bo says"))
    assert stored().status is Status.IN_WORK
    assert zoe.session.shown == "walk"
    zoe.press("Finish the trial, go to the next")
    zoe.until(lambda: zoe.session.shown != "walk")
    assert (stored().status, stored().status_author) == (Status.FINISHED, "Zoë")
    assert not stored().accepted
