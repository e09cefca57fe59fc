"""A row that cannot be read comes into the review while a page is open: it says so, and asks later."""

import sqlite3

from addb_viewer.jobs.review_store import FILE, open_log
from annotations.events import Status

FEET = ("calcn_r", "calcn_l")


def spoil(folder, trial):
    """A row as a newer version might write it."""
    open_log(folder).close()
    with sqlite3.connect(folder / FILE) as connection:
        connection.execute(
            "INSERT INTO edits (subject, trial, author, made_at, kind, content) "
            "VALUES ('', ?, 'Bo', '2024-09-01T12:00:00+00:00', 'merge', '{}')",
            (trial,),
        )
    connection.close()


def test_the_page_says_so_and_t_does_before_the_trial_is_finished(app, enter, tmp_path):
    browser = enter(app, at="run")
    spoil(tmp_path, "run")
    said = "row 1 by Bo of the review log cannot be read"
    browser.until(lambda: f"⚠ {said}" in browser.html(), "the warning")
    browser.until(lambda: browser.told(said), "the notice")
    browser.go_to("20:30")
    browser.until(lambda: browser.session.review.chosen == (20, 30))
    browser.press("Flag: force wrong")
    browser.until(lambda: "20–29" in browser.html(), "the flag")
    browser.press("Finish the trial, go to the next")
    browser.until(lambda: browser.asked(f"Of this trial, {said}"), "what speaks against it")
    with open_log(tmp_path) as log:
        assert log.review("run", FEET).status is Status.IN_WORK
    browser.press("Finish the trial, go to the next")
    with open_log(tmp_path) as log:
        browser.until(lambda: log.review("run", FEET).status is Status.FINISHED, "the finishing")
        assert [row.number for row in log.unreadable()] == [1]
