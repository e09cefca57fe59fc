"""What T, Shift T and the keys of the review do, in sessions without a picture."""

import numpy as np
import pytest

from addb_viewer.app.queue import queue_controller
from addb_viewer.app.scene.camera import distance_to_see
from addb_viewer.trial_view.worst_frame import worst_frame
from annotations.events import Status
from annotations.suggested_activity import SuggestedActivity

T, SHIFT_T = "Finish the trial, go to the next", "Accept what is sure, finish, go to the next"


def test_a_key_hit_twice_is_one_t(app, enter, stored, monkeypatch):
    monkeypatch.setattr(queue_controller, "READ_S", 0.5)
    browser = enter(app)
    now = 100.0
    browser.session.finishing._clock = lambda: now
    browser.press(T)
    browser.until(lambda: browser.asked("Finish walk?"), "the question")
    for later in (100.4, 100.8):
        now = later
        browser.press(T)
        browser.until(lambda: browser.asked("Finish walk?"), "the question again")
        assert stored().status is Status.UNSEEN
    now = 102.0
    browser.press(T)
    browser.until(lambda: stored().status is Status.FINISHED)


def test_shift_t_says_what_stays_undecided_then_accepts_what_is_sure_and_u_goes_back(app, enter, stored):
    browser = enter(app)
    browser.press("Next proposal or flagged range")
    browser.until(lambda: browser.session.review.chosen == (20, 30))
    browser.press(SHIFT_T)
    browser.until(
        lambda: browser.asked("Open proposals of which detection is not sure: 2. Their forces count.")
    )
    browser.until(lambda: browser.asked("Accepts 1 proposal of at least 80 %."))
    assert not stored().accepted, "nothing is done before it is decided"
    browser.press(T)
    browser.press("No, to the question")
    browser.until(lambda: not browser.questions)
    assert stored().status is Status.UNSEEN, "another key does not decide"
    browser.press(T)
    browser.until(lambda: browser.asked("leaves out: 60–79 left. It stays left out"), "T's own words")
    browser.press("No, to the question")
    browser.press(SHIFT_T)
    browser.press(SHIFT_T)
    browser.until(lambda: browser.session.shown == "run")
    assert not browser.questions, "nothing of a trial outlives it"
    browser.until(lambda: browser.told("Accepted 1 proposal of at least 80 %. Next: run"))
    review = stored()
    assert review.status is Status.FINISHED
    assert [(f.start, f.end, f.foot) for f in review.flags] == [(60, 80, "calcn_l")]
    browser.press("Undo")
    browser.until(lambda: browser.session.shown == "walk")
    browser.until(lambda: stored().status is not Status.FINISHED)
    assert stored().accepted, "the next U takes that back"
    browser.press("Undo")
    browser.until(lambda: not stored().accepted)


def test_shift_t_finishes_at_once_where_all_that_is_open_is_sure(app, enter, stored):
    browser = enter(app)
    for label, at in (("Next proposal or flagged range", (20, 30)), ("Reject the proposal", (60, 80))):
        browser.press(label)
        browser.until(lambda at=at: browser.session.review.chosen == at)
    browser.go_to("100:110")
    browser.press("Clear: the force counts")
    browser.until(lambda: (100, 110) in [(c.start, c.end) for c in stored().cleared])
    browser.press(SHIFT_T)
    browser.until(lambda: browser.session.shown == "run")
    assert [(p.start, p.end) for p in stored().accepted] == [(60, 80)]


def test_the_whole_trial_gets_its_activity_by_two_keys_and_y_takes_what_is_suggested(
    tmp_path, make_replay, make_app, enter, stored
):
    replay = make_replay()
    object.__setattr__(replay, "suggested", (SuggestedActivity(0, 150, "jump", "drop jump", 0.9),))
    app = make_app(tmp_path, [replay])
    try:
        browser = enter(app)
        browser.press("Activity of the whole trial")
        browser.until(lambda: browser.asked("What does the person do in walk?"))
        browser.until(lambda: browser.asked("drop jump, as suggested (Y)"))
        browser.press("Yes, to the question")
        browser.until(
            lambda: [(a.start, a.end, a.label) for a in stored().activities] == [(0, 200, "drop jump")]
        )
        browser.press("Activity of the whole trial")
        browser.until(lambda: browser.questions)
        browser.press("Flag: foot contact but no force")  # 2
        browser.until(lambda: [a.label for a in stored().activities] == ["run"])
        browser.until(lambda: not browser.questions)
        assert not stored().flags
    finally:
        app.close()


def test_the_worst_frame_that_counts_is_gone_to_and_said(app, enter, make_replay):
    residual = make_replay().residual
    over = np.fmax(
        np.linalg.norm(residual.force, axis=1) / residual.force_limit,
        np.linalg.norm(residual.moment, axis=1) / residual.moment_limit,
    )
    expected = max(np.flatnonzero(residual.used), key=lambda frame: over[frame])
    assert worst_frame(residual)[0] == expected
    browser = enter(app)
    browser.press("Worst frame that counts")
    browser.until(lambda: browser.session.frame == expected)
    browser.until(
        lambda: browser.told(f"Frame {expected}: residual 100 N, 10 N·m; the limits are 35 N, 12 N·m")
    )


def test_the_selected_range_is_played_again_and_again(app, enter):
    browser = enter(app)
    browser.press("Loop the selected range")
    browser.until(lambda: browser.told("select a range first"))
    browser.go_to("20:24")
    browser.until(lambda: browser.session.review.chosen == (20, 24))
    browser.press("Loop the selected range")
    browser.until(lambda: browser.session.playing)
    seen = []
    browser.until(lambda: seen.append(browser.session.frame) or sum(np.diff(seen) < 0) >= 3, "three rounds")
    assert 20 <= min(seen) <= max(seen) < 24
    assert browser.session.review.chosen == (20, 24)
    browser.press("Loop the selected range")
    browser.until(lambda: not browser.session.playing)


@pytest.mark.parametrize("aspect", [0.5, 1.0, 2.4])
def test_a_fitted_camera_sees_all_points_and_one_of_them_at_the_margin(aspect):
    """Held against a pinhole camera's projection."""
    rng = np.random.default_rng(5)
    points = rng.normal(0.0, (0.4, 0.9, 0.3), (40, 3)) + np.array([2.0, 1.0, -3.0])
    center = 0.5 * (points.min(axis=0) + points.max(axis=0))
    back, fov = np.array([0.48, 0.36, 0.8]), np.radians(40.0)
    eye = center + distance_to_see(points, center, back, fov, aspect) * back
    right = np.cross((0.0, 1.0, 0.0), back)
    right /= np.linalg.norm(right)
    seen = points - eye
    depth = -(seen @ back)
    across = (seen @ right) / depth / np.tan(fov / 2) / aspect
    above = (seen @ np.cross(back, right)) / depth / np.tan(fov / 2)
    assert (depth > 0).all()
    assert np.abs(np.concatenate([across, above])).max() == pytest.approx(0.9)


def test_v_looks_at_the_person_from_the_same_side(app, enter):
    browser = enter(app)
    camera = browser.session.client.camera
    back = np.subtract(camera.position, camera.look_at)
    points = browser.session.scene.extent(browser.session.frame)
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    browser.press("Fit the view to the person")
    browser.until(lambda: np.allclose(camera.look_at, middle), "the view")
    now = np.subtract(camera.position, camera.look_at)
    assert np.allclose(now / np.linalg.norm(now), back / np.linalg.norm(back), atol=1e-6)
