"""Sessions of several browsers on one app, spoken to as a page would, without a picture."""

import gc
import threading
import weakref
from dataclasses import replace

import numpy as np

from addb_viewer.app.queue import queue_controller
from addb_viewer.jobs.review_store import open_log
from addb_viewer.trial_view.missing_force import MissingForce
from annotations.events import SetStatus, Status
from annotations.review_errors import ReviewError
from annotations.suggested_activity import SuggestedActivity
from tests.patience import PATIENCE_S


def flags(review):
    return [(f.start, f.end, f.foot, f.reason, f.author) for f in review.flags]


def test_every_browser_has_its_own_trial_cursor_and_camera(app, enter):
    one, other = enter(app), enter(app, at="walk")
    one.press("1 s on")
    one.until(lambda: one.session.frame == 100)
    other.open_trial("run")
    other.until(lambda: other.session.shown == "run")
    assert one.session.shown == "walk"
    assert other.session.frame == 0
    other.press("Play or pause")
    other.until(lambda: other.session.frame > 5)
    assert one.session.frame == 100


def test_a_browser_that_leaves_leaves_nothing_behind(app, enter):
    before = threading.active_count()
    browser = enter(app)
    session = weakref.ref(browser.session)
    browser.press("Play or pause")
    browser.session = None
    browser.close()
    browser.until(lambda: not app.sessions)
    browser.until(lambda: threading.active_count() <= before + 2, "the threads")  # viser keeps its workers
    browser.until(lambda: gc.collect() is not None and session() is None, "the session's memory")
    assert not app.subjects.loaded[0].is_watched


def test_keys_paint_undo_and_redo_and_each_is_in_the_store(app, enter, stored):
    browser = enter(app)
    for key in ("1 s on", "Start of a range", "1 s back", "0.1 s on"):
        browser.press(key)
    browser.press("Foot: right, left, both")
    browser.until(lambda: browser.session.review.foot == "calcn_r")
    browser.go_to("120:140")
    browser.until(lambda: browser.session.review.chosen == (120, 140))
    assert browser.session.frame == 120
    browser.press("Flag: not over a plate")
    expected = [(120, 140, "calcn_r", "notOverForcePlate", "Zoë")]
    browser.until(lambda: flags(stored()) == expected)
    browser.press("Undo")
    browser.until(lambda: flags(stored()) == [])
    browser.press("Redo")
    browser.until(lambda: flags(stored()) == expected)
    browser.until(lambda: "120–139" in browser.html())


def test_i_and_o_select_and_a_digit_without_them_takes_the_contact(app, enter, stored):
    browser = enter(app)
    browser.press("Flag: force wrong")
    browser.until(lambda: flags(stored()) == [(0, 60, "calcn_r", "forceDiscrepancy", "Zoë")])
    browser.press("1 s on")
    browser.press("Start of a range")
    browser.press("0.1 s on")
    browser.press("End of a range")
    browser.press("Flag: other")
    browser.until(lambda: (100, 111, None, "manualReview", "Zoë") in flags(stored()))
    browser.press("Flag: markers bad")  # painted again at the same place
    browser.until(lambda: (100, 111, None, "tooHighMarkerRMS", "Zoë") in flags(stored()))
    browser.press("Last frame")
    browser.press("Clear: the force counts")
    browser.until(lambda: browser.told("no contact at frame 199"))
    assert len(flags(stored())) == 2


def test_n_shows_where_most_force_is_missing_and_plays_the_range_until_something_is_done(
    tmp_path, make_replay, make_app, enter
):
    missing = np.zeros((200, 2))
    missing[67, 1], missing[62, 0], missing[104, :] = 512.0, 900.0, np.nan
    replay = replace(make_replay(), missing=MissingForce(missing, missing.sum(axis=1)))
    app = make_app(tmp_path, [replay])
    try:
        browser = enter(app)
        session = browser.session
        browser.go_to("59")
        browser.until(lambda: session.frame == 59)
        browser.press("Next proposal or flagged range")
        browser.until(lambda: "512 N missing at 67" in browser.html())
        browser.until(lambda: "/walk/67" in session.channel.shown("address"), "the frame in the address")
        browser.until(lambda: session.playing and session.frame != 67, "the loop")
        assert session.review.chosen == (60, 80)
        browser.press("Flag: foot contact but no force")
        browser.until(lambda: not session.playing, "the end of the loop")
        browser.press("Flag: force wrong")  # painted again: the range is still at hand
        browser.until(
            lambda: (
                [f.reason for f in session.review.review.flags if (f.start, f.end) == (60, 80)]
                == ["forceDiscrepancy"]
            )
        )
        browser.press("Next proposal or flagged range")
        browser.until(lambda: session.review.chosen == (100, 110) and session.playing)
        browser.press("No, to the question")
        browser.until(lambda: session.review.chosen is None and not session.playing, "Esc")
    finally:
        app.close()


def test_a_frame_that_an_address_names_has_the_person_in_the_middle(app, enter):
    browser = enter(app)
    session = browser.session
    session.open_trial("run", 150)
    np.testing.assert_allclose(session.scene.extent(150).mean(axis=0)[[0, 2]], 0.0, atol=0.2)
    np.testing.assert_allclose(session.client.camera.look_at[[0, 2]], 0.0, atol=0.2)


def test_n_and_p_begin_where_the_cursor_is(app, enter):
    browser = enter(app)
    browser.go_to("60")
    browser.until(lambda: browser.session.frame == 60)
    browser.press("Next proposal or flagged range")
    browser.until(lambda: browser.session.review.chosen == (60, 80))
    browser.press("Previous proposal or flagged range")
    browser.until(lambda: browser.session.review.chosen == (20, 30))
    browser.press("Previous proposal or flagged range")  # beyond the first one, from the end
    browser.until(lambda: browser.session.review.chosen == (100, 110))
    browser.press("Next proposal or flagged range")
    browser.until(lambda: browser.session.review.chosen == (20, 30))


def test_proposals_are_gone_through_with_two_keys(app, enter, stored):
    browser = enter(app)
    browser.press("Next proposal or flagged range")
    browser.until(lambda: browser.session.review.chosen == (20, 30))
    assert browser.session.review.current.proposal.reason == "hasInputOutliers"
    browser.press("Reject the proposal")
    browser.until(lambda: browser.session.review.chosen == (60, 80))
    browser.press("Accept the proposal")
    browser.until(lambda: browser.session.review.chosen == (100, 110))
    browser.press("Accept the proposal")
    browser.until(lambda: browser.told("All proposals are decided"))
    review = stored()
    assert [(f.start, f.end, f.foot) for f in review.flags] == [(60, 80, "calcn_l"), (100, 110, "calcn_r")]
    assert [(c.start, c.end) for c in review.cleared] == [(20, 30)]
    browser.press("Accept the proposal")
    browser.until(lambda: browser.told("no open proposal here"))


def test_finishing_goes_on_to_the_next_trial_and_says_when_all_is_done(app, enter, stored):
    browser = enter(app)
    browser.finish("detection leaves out: 60–79 left. It stays left out", "not sure: 2")
    browser.until(lambda: browser.session.shown == "run")
    review = stored()
    assert (review.status, review.status_author) == (Status.FINISHED, "Zoë")
    assert [(out.start, out.end, out.foot) for out in review.stays_out] == [(60, 80, "calcn_l")]
    browser.finish()
    browser.until(lambda: browser.asked("Every trial has been reviewed"))
    assert browser.asked("2 trials")


def test_one_key_too_many_finishes_nothing(app, enter, stored, monkeypatch):
    monkeypatch.setattr(queue_controller, "SEEN_S", 2.0)
    browser = enter(app)
    browser.finish()
    browser.until(lambda: browser.session.shown == "run")
    browser.press("Finish the trial, go to the next")
    browser.until(lambda: browser.asked("T has just brought you here, and you have not looked at it"))
    assert stored("run").status is Status.UNSEEN


def test_u_right_after_t_takes_the_finishing_back_where_it_was_done(app, enter, stored):
    browser = enter(app)
    browser.finish()
    browser.until(lambda: browser.session.shown == "run")
    browser.press("Undo")
    browser.until(lambda: browser.session.shown == "walk")
    browser.until(lambda: stored().status is Status.UNSEEN)
    assert stored("run").status is Status.UNSEEN
    browser.press("Undo")
    browser.until(lambda: browser.told("nothing of Zoë's to undo"))


def test_after_an_edit_in_the_next_trial_u_takes_that_back(app, enter, stored):
    browser = enter(app)
    browser.finish()
    browser.until(lambda: browser.session.shown == "run")
    browser.press("Flag: force wrong")
    browser.until(lambda: flags(stored("run")))
    browser.press("Undo")
    browser.until(lambda: not flags(stored("run")))
    assert stored().status is Status.FINISHED


def test_t_stays_within_what_the_queues_page_shows_and_says_what_waits_beside_it(app, enter, stored):
    browser = enter(app)
    app.queue.orders[browser.session.reviewer.browser] = ((".", "walk"),)
    browser.finish()
    browser.until(lambda: browser.asked("1 trial waits beside it"))
    browser.press("No, to the question")
    assert browser.session.shown == "walk"
    browser.press("Undo")
    browser.until(lambda: stored().status is Status.UNSEEN)


def test_a_trial_without_a_fit_is_said_before_it_is_finished(tmp_path, make_replay, make_app, enter):
    app = make_app(tmp_path, [make_replay(fitted=False), make_replay("run", 180, fitted=False)], login="Zoë")
    try:
        browser = enter(app)
        browser.finish("Nothing has been fitted to this trial yet")
        browser.until(lambda: browser.told("Next: run. Nothing is fitted to it yet. G fits it."))
        with open_log(tmp_path) as log:
            (edit,) = log.history("walk")
        assert edit.event == SetStatus(Status.FINISHED), "detection is still asked"
    finally:
        app.close()


def test_a_name_is_asked_for_once_before_the_first_decision_which_is_then_done(app, enter, stored):
    browser = enter(app, name=None)
    browser.press("One frame on")
    browser.press("Flag: force wrong")
    browser.until(lambda: browser.asked("Who is reviewing?"))
    assert browser.asked("Zoë")  # who runs the server: a suggestion
    browser.press("Flag: other")  # keys are for nobody while a dialog waits
    for name, why in [
        (" ", "a decision needs a name"),
        ("imported", "labels from files"),
        ("n" * 61, "at most 60"),
    ]:
        browser.put("Your name", name)
        browser.click("Decide under this name")
        browser.until(lambda why=why: browser.asked(why))
    assert flags(stored()) == []
    browser.put("Your name", "  Ada  Byron ")
    browser.click("Decide under this name")
    browser.until(lambda: flags(stored()) == [(0, 60, "calcn_r", "forceDiscrepancy", "Ada Byron")])
    browser.until(lambda: not browser.questions)
    assert browser.memory["reviewer"] == "Ada Byron"
    browser.press("Flag: other")
    browser.until(lambda: flags(stored()) == [(0, 60, "calcn_r", "manualReview", "Ada Byron")])
    assert not browser.questions


def test_who_does_not_say_a_name_decides_nothing_and_is_asked_again(app, enter, stored):
    browser = enter(app, name=None)
    for _ in range(2):
        browser.press("Flag: force wrong")
        browser.until(lambda: browser.asked("Who is reviewing?"))
        browser.press("No, to the question")
        browser.until(lambda: not browser.questions)
    assert flags(stored()) == []


def test_a_name_is_changed_at_any_time_and_later_decisions_bear_it(app, enter, stored):
    browser = enter(app)
    browser.press("Flag: force wrong")
    browser.until(lambda: [f[-1] for f in flags(stored())] == ["Zoë"])
    browser.press("Change your name")
    browser.until(lambda: browser.asked("Who is reviewing?"))
    browser.put("Your name", "Ada")
    browser.click("Decide under this name")
    browser.until(lambda: "You decide as <b>Ada</b>" in browser.html())
    browser.press("Undo")
    browser.until(lambda: browser.told("nothing of Ada's to undo"))
    browser.press("Flag: other")
    browser.until(lambda: [f[-1] for f in flags(stored())] == ["Ada"])


def test_everything_is_there_again_after_a_restart(app, enter, stored, make_replay, make_app):
    folder = app.subjects.loaded[0].subject.folder
    browser = enter(app)
    browser.go_to("120:140")
    browser.press("Flag: not over a plate")
    browser.until(lambda: flags(stored()))
    browser.close()
    app.close()
    again = make_app(folder, [make_replay()], login="Zoë")
    try:
        browser = enter(again)
        browser.until(lambda: "120–139" in browser.html())
        browser.press("Undo")
        browser.until(lambda: flags(stored()) == [])
    finally:
        again.close()


def test_a_second_look_and_a_label_are_recorded_with_their_note(app, enter, stored):
    browser = enter(app)
    browser.put("Note", "stumbles")
    browser.put("Label", "walk, treadmill")
    browser.until(lambda: browser.session.review.panel.activity.value == "walk, treadmill")
    browser.session.notices.do("Labelling", browser.session.review.activities.label)
    browser.until(lambda: [(a.start, a.end, a.label, a.note) for a in stored().activities])
    (activity,) = stored().activities
    assert (activity.start, activity.end, activity.label, activity.note) == (
        0,
        200,
        "walk treadmill",
        "stumbles",
    )
    browser.press("Needs a second look")
    browser.until(lambda: stored().status is Status.SECOND_LOOK)


def test_a_suggested_activity_is_confirmed_or_refused_and_says_nothing_before(
    tmp_path, make_app, make_replay, enter, stored
):
    walk = SuggestedActivity(0, 120, "walk", "overground", 0.9)
    squat = SuggestedActivity(120, 200, "squat", None, 0.7)
    app = make_app(tmp_path, [replace(make_replay(), suggested=(walk, squat))])
    try:
        browser = enter(app)
        browser.until(lambda: "walk overground" in browser.html())
        assert stored().activities == ()
        review, do = browser.session.review, browser.session.notices.do
        do("Labelling", review.activities.confirm)
        browser.until(lambda: [(a.start, a.end, a.label) for a in stored().activities])
        assert [(a.start, a.end, a.label) for a in stored().activities] == [(0, 120, "walk overground")]
        browser.until(lambda: review.activities.suggested == (squat,))
        browser.go_to("120:200")
        browser.until(lambda: review.activities.suggestion == squat)
        do("Labelling", review.activities.refuse)
        browser.until(lambda: review.activities.suggested == ())
        assert [a.label for a in stored().activities] == ["walk overground"]
        do("Undoing", review.undo)
        browser.until(lambda: review.activities.suggested == (squat,))
    finally:
        app.close()


def test_an_edit_by_the_store_alone_updates_the_queue(app, enter):
    browser = enter(app)
    with open_log(app.subjects.loaded[0].subject.folder) as log:
        log.append("run", SetStatus(Status.FINISHED), "Bo")
    browser.until(lambda: sum(row.finished for row in app.queue.rows()) == 1)


def test_what_cannot_be_drawn_is_told_and_the_next_frame_is(app, enter, monkeypatch):
    browser = enter(app)
    monkeypatch.setattr(browser.session.scene, "draw", lambda *frame: 1 / 0)
    browser.press("One frame on")
    browser.until(lambda: browser.told("Drawing failed division by zero"))
    monkeypatch.undo()
    browser.press("One frame on")
    browser.until(lambda: browser.frame == 2)


def test_a_box_takes_frames_and_ranges_and_ignores_what_is_not_whole(app, enter):
    browser = enter(app)
    for text in ("", "7:", "abc", "57"):
        browser.go_to(text)
    browser.until(lambda: browser.session.frame == 57)
    browser.go_to("500:900")
    browser.until(lambda: browser.told("no such frames; the trial has 0–199"))
    browser.press("Choose a trial")
    browser.until(lambda: browser.questions)
    browser.go_to("#99")
    browser.until(lambda: browser.told("the queue has changed"))


def test_escape_and_a_click_elsewhere_drop_the_selection(app, enter):
    browser = enter(app)
    for dropped in (lambda: browser.press("No, to the question"), lambda: browser.go_to("150")):
        browser.go_to("")
        browser.go_to("120:140")
        browser.until(lambda: browser.session.review.chosen == (120, 140))
        dropped()
        browser.until(lambda: browser.session.review.chosen is None)
    browser.until(lambda: browser.session.frame == 150)
    browser.press("Start of a range")
    browser.go_to("170")  # a border that waits for the other one stays
    browser.until(lambda: browser.session.frame == 170)
    browser.press("End of a range")
    browser.until(lambda: browser.session.review.chosen == (150, 171))


def test_the_foot_does_not_stick_to_another_trial(app, enter):
    browser = enter(app)
    browser.press("Foot: right, left, both")
    browser.until(lambda: browser.session.review.foot == "calcn_r")
    browser.session.notices._hand.submit(browser.session.show_fit).result(PATIENCE_S)
    assert browser.session.review.foot == "calcn_r", "the same trial, as another solve has it"
    browser.open_trial("run")
    browser.until(lambda: browser.session.shown == "run" and browser.session.review.foot is None)


def test_enter_and_backspace_act_on_what_the_line_above_says(app, enter, stored):
    browser = enter(app)
    browser.go_to("60:80")
    browser.until(lambda: browser.session.review.chosen == (60, 80))
    browser.until(lambda: "foot contact but no force?" in browser.html())
    browser.go_to("62:75")  # inside the same proposal, but other frames
    browser.until(lambda: browser.session.review.chosen == (62, 75))
    browser.press("Reject the proposal")
    browser.until(lambda: browser.told("no open proposal on the selected frames"))
    assert not stored().rejected
    browser.press("No, to the question")
    browser.until(lambda: "left 60–79: foot contact but no force?" in browser.html())
    browser.press("Reject the proposal")
    browser.until(lambda: [(p.start, p.end) for p in stored().rejected] == [(60, 80)])


def test_what_u_took_back_is_selected(app, enter, stored):
    browser = enter(app)
    browser.go_to("120:140")
    browser.until(lambda: browser.session.review.chosen == (120, 140))
    browser.press("Flag: force wrong")
    browser.until(lambda: flags(stored()))
    browser.press("First frame")
    browser.until(lambda: browser.session.frame == 0 and browser.session.review.chosen is None)
    browser.press("Undo")
    browser.until(lambda: browser.session.review.chosen == (120, 140))
    assert browser.session.frame == 120


def failures_in_the_bar(browser):
    """Those that were told and not sent away yet."""
    return [n for n in browser.session.channel.shown("notices") if n["error"] and not n["gone"]]


def test_a_failed_edit_keeps_its_note_and_escape_closes_what_was_told(app, enter, stored, monkeypatch):
    browser = enter(app)
    browser.put("Note", "seen on video")
    browser.until(lambda: browser.session.review.panel.note.value)
    browser.press("Last frame")
    browser.press("Flag: force wrong")
    browser.until(lambda: browser.told("no contact at frame 199"))

    def busy(*_):
        raise ReviewError("the review log is busy")

    book = app.subjects.loaded[0].reviews
    with monkeypatch.context() as patched:
        patched.setattr(book, "record", busy)
        browser.press("First frame")
        browser.press("Flag: force wrong")
        browser.until(lambda: browser.told("the review log is busy"))
        assert browser.session.review.panel.note.value == "seen on video"
    assert failures_in_the_bar(browser)
    browser.press("No, to the question")
    browser.until(lambda: not failures_in_the_bar(browser))
    browser.press("Flag: force wrong")
    browser.until(lambda: [flag.note for flag in stored().flags] == ["seen on video"])
    browser.until(lambda: browser.session.review.panel.note.value == "")
