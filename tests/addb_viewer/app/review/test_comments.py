"""Comments under Review: said at the frame on the screen, answered and settled by another person."""

import pytest

from addb_viewer.app.review.comments import NEW


@pytest.fixture
def two(tmp_path, make_replay, make_app, enter):
    app = make_app(tmp_path, [make_replay(), make_replay("run")], login="Zoë")
    yield enter(app), enter(app, name="Ben", at="walk")
    app.close()


def test_a_comment_at_a_frame_is_answered_and_settled_by_somebody_else(two):
    zoe, ben = two
    zoe.open_trial("walk")
    zoe.go_to("57")
    zoe.until(lambda: (zoe.session.shown, zoe.session.frame) == ("walk", 57))
    zoe.put("Comment", "<b>A stumble?</b>")
    zoe.click("Say it")
    ben.until(lambda: "<b>Zoë</b>: &lt;b&gt;A stumble?&lt;/b&gt;" in ben.html(), "the comment")
    assert "data-addb-go-to='57'" in ben.html()
    name = ben.until(lambda: [o for o in ben.field("About")["options"] if o != NEW])[0]
    assert "frame 57, Zoë" in name
    ben.put("About", name)
    ben.put("Comment", "Yes.")
    ben.click("Say it")
    zoe.until(lambda: "<b>Ben</b>: Yes." in zoe.html(), "the answer")
    zoe.until(lambda: zoe.told("Ben answers on walk"), "the notice")
    assert not ben.told("answers on")
    ben.click("Settled")
    zoe.until(lambda: "settled by Ben" in zoe.html(), "the end of the talk")
    assert "<b>Ben</b>: Yes." not in zoe.html()  # in short


def test_a_comment_belongs_to_its_trial_and_needs_words(two):
    zoe, _ = two
    zoe.open_trial("walk")
    zoe.until(lambda: zoe.session.shown == "walk")
    zoe.click("Say it")
    zoe.until(lambda: zoe.told("a comment needs words"))
    zoe.put("Comment", "Slow.")
    zoe.click("Say it")
    zoe.until(lambda: "<b>Zoë</b>: Slow." in zoe.html())
    zoe.open_trial("run")
    zoe.until(lambda: "No comments on this trial" in zoe.html())
