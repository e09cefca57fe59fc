"""The queue's page at its connection: rows, who is where, what is asked for, and what is turned away."""

import contextlib
import json
import urllib.error
import urllib.request

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from addb_viewer.app.app import ReviewApp
from addb_viewer.app.queue.page_channel import CONNECTION, FILES, PAGE, asked
from addb_viewer.app.queue.trial_queue import TrialQueue
from addb_viewer.app.security.access import Access
from addb_viewer.app.security.server import open_server
from addb_viewer.app.subjects.open_subjects import OpenSubjects
from addb_viewer.jobs.review_store import open_log
from addb_viewer.jobs.root_folder import RootFolder
from annotations.events import FlagRange
from annotations.review_errors import ReviewError
from tests.patience import PATIENCE_S

TRIALS = {"S1": ("walk", "run"), "S2": ("walk",)}


class Page:
    """A queue page without a picture."""

    def __init__(self, port, name="Zoë", **options):
        self._socket = connect(f"ws://127.0.0.1:{port}{CONNECTION}", open_timeout=PATIENCE_S, **options)
        self.rows, self.live, self.said = {}, {}, []
        if name is not None:
            self.say("hello", text=name)

    def say(self, what, **more):
        self._socket.send(json.dumps({"what": what, **more}))

    def until(self, condition):
        """Hear until it holds; what `condition` then gives."""
        while not (found := condition()):
            message = json.loads(self._socket.recv(timeout=PATIENCE_S))
            self.said.append(message)
            for row in message.get("rows", ()):
                self.rows[row["subject"], row["trial"]] = row
            if message["kind"] == "live":
                self.live = message
        return found

    def told(self, kind):
        return self.until(lambda: next((m for m in self.said if m["kind"] == kind), None))

    def close(self):
        self._socket.close()


@pytest.fixture
def root(tmp_path):
    for subject, trials in TRIALS.items():
        (tmp_path / subject).mkdir()
        lines = []
        for trial in trials:
            (tmp_path / subject / f"{trial}.trc").write_text("markers")
            lines.append(f'[trials.{trial}]\nmarkers = "{trial}.trc"')
        (tmp_path / subject / "subject.toml").write_text("\n".join(lines))
    return tmp_path


@pytest.fixture
def app(root):
    trials = TrialQueue(OpenSubjects(RootFolder(root, tuple(TRIALS))))
    app = ReviewApp(open_server(port=0), trials, "S1", login="Zoë")
    yield app
    app.close()


@pytest.fixture
def open_queue(app):
    with contextlib.ExitStack() as stack:

        def opened(name="Zoë", **options):
            page = Page(app.server.get_port(), name, **options)
            stack.callback(page.close)
            page.until(lambda: len(page.rows) == 3)
            return page

        yield opened


def test_what_others_record_shows_on_an_open_page(open_queue, root):
    page = open_queue()
    assert {row["status"] for row in page.rows.values()} == {"unseen"}
    with open_log(root / "S2") as log:
        log.append("walk", FlagRange(0, 5, "manualReview"), "ben")
    page.until(lambda: page.rows["S2", "walk"]["last"] is not None)
    assert page.rows["S2", "walk"]["last"][0] == "ben"
    assert page.rows["S1", "walk"]["last"] is None


def test_many_are_assigned_at_once_and_every_page_hears_of_it(open_queue, root):
    page, other = open_queue(), open_queue("Ben")
    page.say("assign", places=[["S1", "walk"], ["S2", "walk"], ["S9", "walk"], ["S1", "../x"]], text="Ben")
    for each in (page, other):
        each.until(lambda each=each: sum(row["assigned"] == "Ben" for row in each.rows.values()) == 2)
    assert page.rows["S1", "run"]["assigned"] == ""
    assert not (root / "S9").exists()


def test_a_comment_is_answered_and_settled_by_others(open_queue):
    page, other = open_queue(), open_queue("Ben")
    place = {"places": [["S1", "walk"]]}
    page.say("comment", **place, text="<b>A stumble?</b>", frame=57)
    number = page.told("comments")["comments"][0]["number"]
    other.until(lambda: other.rows["S1", "walk"]["openComments"] == 1)
    other.say("comment", **place, text="Yes.", number=number)
    (thread,) = other.told("comments")["comments"]
    assert thread["frame"] == 57
    assert [said[::2] for said in thread["said"]] == [["Zoë", "<b>A stumble?</b>"], ["Ben", "Yes."]]
    other.say("settle", **place, number=number)
    page.until(
        lambda: page.rows["S1", "walk"]["comments"] == 1 and not page.rows["S1", "walk"]["openComments"]
    )


def test_without_a_name_one_may_look_but_do_nothing(open_queue, root):
    page = open_queue(name=None)
    page.say("assign", places=[["S1", "walk"]], text="Ben")
    assert "say your name" in page.told("told")["text"]
    page.say("people")
    assert page.told("people")["people"] == []
    assert not list(root.glob("*/annotations.sqlite"))


def test_what_cannot_be_done_is_told(open_queue):
    page = open_queue()
    page.say("diagnose", places=[["S1", "walk"]])
    assert page.told("told") == {"kind": "told", "bad": True, "text": "none of them has a fit yet"}
    page.said.clear()
    page.say("comment", places=[["S1", "jump"]], text="?")
    assert "no such trial" in page.told("told")["text"]
    page.said.clear()
    page.say("settle", places=[["S1", "walk"]], number=7)
    assert "has no comment 7" in page.told("told")["text"]


def test_who_is_on_a_trial_shows(app, open_queue):
    page = open_queue()
    app.queue.people.arrive(99, "Ben", "browser")
    app.queue.people.go(99, ("S1", "run"))
    page.until(lambda: page.live.get("here") == [["S1", "run", ["Ben"]]])
    app.queue.people.leave(99)
    page.until(lambda: page.live.get("here") == [])


def test_while_a_browsers_queue_page_is_open_t_goes_through_what_it_shows(app, open_queue, enter):
    review = enter(app, trial=False)
    queue, browser = review.session.queue, review.session.reviewer.browser
    assert [row.subject for row in queue.let_through()] == ["S1", "S1", "S2"]
    page = open_queue()
    page.say("order", text="another browser", places=[["S2", "walk"]])
    page.say("people")
    page.told("people")
    assert len(queue.let_through()) == 3
    own = open_queue()
    own.say("order", text=browser, places=[["S2", "walk"], ["S1", "run"], ["S9", "gone"]])
    review.until(lambda: len(queue.let_through()) == 2)
    assert [(row.subject, row.trial) for row in queue.let_through()] == [("S2", "walk"), ("S1", "run")]
    own.close()
    review.until(lambda: len(queue.let_through()) == 3)


def test_a_page_has_one_order_of_trials_that_there_are_however_many_it_sends(app, open_queue):
    page = open_queue()
    for number in range(12):
        synthetic = [["S1", f"{number} {k}"] for k in range(20_000)]
        page.say("order", text=f"browser {number}", places=[*synthetic, ["S2", "walk"], ["S2", "walk"]])
    page.say("people")
    page.told("people")
    assert app.queue.orders == {"browser 11": (("S2", "walk"),)}


MALFORMED = [
    "[]",
    "{",
    '{"what": "drop table"}',
    '{"what": "assign", "places": [["S1"]]}',
    '{"what": "assign", "places": [["S1", 5]]}',
    '{"what": "assign", "places": "ab"}',
    '{"what": "comment", "frame": -1}',
    '{"what": "comment", "frame": true}',
    '{"what": "comment", "number": 1.5}',
    '{"what": "comment", "text": 5}',
    '{"what": ["fit"]}',
    "[" * 100_000,
]


@pytest.mark.parametrize("message", MALFORMED)
def test_what_is_no_message_of_the_page_is_none(message):
    with pytest.raises(ReviewError, match="no message"):
        asked(message)


def test_a_malformed_message_ends_its_senders_connection_alone(open_queue, caplog):
    page, other = open_queue(), open_queue("Ben")
    page._socket.send('{"what": "drop table"}')
    with pytest.raises(ConnectionClosed):
        page.until(lambda: False)
    other.say("people")
    assert other.told("people")
    assert "would not" in caplog.text


def test_the_door_is_that_of_the_app(root):
    app = ReviewApp(
        open_server(port=0, access=Access("127.0.0.1", "right")),
        TrialQueue(OpenSubjects(RootFolder(root, tuple(TRIALS)))),
        "S1",
        access=Access("127.0.0.1", "right"),
    )
    port = app.server.get_port()
    cookie = {"Cookie": f"addb_viewer_{port}=right"}
    try:
        for path in (PAGE, f"{FILES}/main.js"):
            with pytest.raises(urllib.error.HTTPError, match="403"):
                urllib.request.urlopen(f"http://127.0.0.1:{port}{path}", timeout=PATIENCE_S)
        for headers in ({}, cookie | {"Origin": "http://evil.example"}):
            with pytest.raises(InvalidStatus):
                Page(port, additional_headers=headers)
        Page(port, additional_headers=cookie | {"Origin": f"http://127.0.0.1:{port}"}).close()
        request = urllib.request.Request(f"http://127.0.0.1:{port}{PAGE}?x=1", headers=cookie)
        with urllib.request.urlopen(request, timeout=PATIENCE_S) as answer:
            assert answer.url.endswith(PAGE)  # nothing stays behind the ?
            policy = answer.headers["Content-Security-Policy"]
    finally:
        app.close()
    assert "script-src 'self';" in policy
    assert "unsafe" not in policy
    assert "frame-ancestors 'none'" in policy
