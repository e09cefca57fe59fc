"""A note that is typed while the edit before is being recorded belongs to the next edit."""

import threading

from addb_viewer.app.review import review_panel
from addb_viewer.jobs.review_store import open_log


def test_a_note_typed_as_the_one_before_is_taken_away_stays(app, tmp_path, enter, monkeypatch):
    browser = enter(app)
    emptied = []
    really_put = review_panel.put

    def put(handle, value):
        """The page's words arrive between the look at the box and this, if they can arrive at all."""
        if handle is browser.session.review.panel.note and value == "" and not emptied:
            emptied.append(threading.current_thread().name)
            browser.put("Note", "second")
            if browser.session.notices.at_hand:
                browser.until(lambda: handle.value == "second", "the note to arrive")
        really_put(handle, value)

    monkeypatch.setattr(review_panel, "put", put)
    browser.put("Note", "first")
    for frames in ("20:30", "50:60"):
        start, end = map(int, frames.split(":"))
        browser.go_to(frames)
        browser.until(lambda here=(start, end): browser.session.review.chosen == here, frames)
        browser.press("Flag: other")
        browser.until(lambda n=start: browser.session.review.recorded == (1 if n == 20 else 2), "the edit")
        browser.until(lambda: emptied, "the box to be emptied")
    with open_log(tmp_path) as log:
        assert [edit.event.note for edit in log.history("walk")] == ["first", "second"]
