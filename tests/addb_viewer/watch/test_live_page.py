"""The page for the laboratory's screen: it answers GET alone, and shows texts as texts."""

import json
import socket
import urllib.error
import urllib.request

import pytest

from addb_viewer.watch.live_page import LivePage, state_of
from addb_viewer.watch.watching import Session
from solver.common.errors import SolverError

EVIL = "<img src=x onerror=document.title='evil'>"
LINE = {
    "subject": EVIL,
    "trial": EVIL,
    "words": f"Torques usable · {EVIL}",
    "to_do": f"Repeat: {EVIL}",
    "sign": "!",
}
LINE |= {"colour": "yellow", "stage": "verdict", "when": "2026-11-29T10:00:00Z"}
FORMER = LINE | {"trial": "walk"}
STATE = {
    "folder": EVIL,
    "last": LINE,
    "busy": False,
    "trials": [LINE, FORMER],
    "troubles": [EVIL],
    "unlisted": [],
}
STATE |= {"plan": [{"words": EVIL, "done": True}]}


@pytest.fixture
def page():
    page = LivePage("127.0.0.1", 0)
    yield page
    page.close()


def asked(page, path="", method="GET", **headers):
    request = urllib.request.Request(page.address + path, method=method, headers=headers)
    try:
        with urllib.request.urlopen(request) as answer:
            return answer.status, answer.headers, answer.read().decode()
    except urllib.error.HTTPError as error:
        return error.code, error.headers, error.read().decode()


def test_it_serves_the_page_and_its_state_and_nothing_else(page):
    page.show(STATE)
    status, headers, text = asked(page)
    assert (status, "<title>addb-viewer watch</title>" in text) == (200, True)
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert json.loads(asked(page, ".json")[2]) == STATE
    for path in ("/../session.py", "x", "/%2e%2e/session.py"):
        assert asked(page, path)[0] == 404


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "OPTIONS"])
def test_it_takes_no_commands(page, method):
    assert asked(page, ".json", method)[0] == 501


def test_who_asks_for_another_machine_gets_nothing(page):
    status, _, text = asked(page, ".json", Host="evil.example")
    assert (status, text) == (403, "This server does not answer for 'evil.example'.")


def test_a_port_that_is_taken_is_said(page):
    port = int(page.address.rpartition(":")[2].partition("/")[0])
    with pytest.raises(SolverError, match=rf"127\.0\.0\.1, port {port}: cannot be listened on .* --port"):
        LivePage("127.0.0.1", port)


def test_what_it_shows_of_a_session(tmp_path, put, judges):
    put(tmp_path / "S01", "walk")
    now = [0.0]
    session = Session(tmp_path, say=lambda *_: None, complain=print, clock=lambda: now[0])
    assert state_of(session)["last"] is None
    for _ in range(16):
        now[0] += 0.25
        session.tick()
        for one in session._judging:
            [future.exception() for future in (one.first, one.fit, one.diagnosis) if future]
    state = state_of(session)
    assert (state["last"]["trial"], state["last"]["colour"], state["last"]["sign"]) == ("walk", "green", "✓")
    assert (len(state["trials"]), state["busy"], state["plan"]) == (1, False, [])


@pytest.mark.browser
@pytest.mark.parametrize(("width", "height"), [(1920, 1080), (1024, 768), (768, 1024)])
def test_it_is_read_from_three_metres_and_runs_nothing_that_comes_from_files(page, browser, width, height):
    page.show(STATE)
    tab = browser.new_page(viewport={"width": width, "height": height})
    tab.goto(page.address)
    tab.wait_for_selector("#plan li")
    for id in ("to_do", "words", "trial"):
        size = tab.evaluate("id => parseFloat(getComputedStyle(document.getElementById(id)).fontSize)", id)
        assert size >= height / 25
    assert tab.inner_text("#to_do") == f"Repeat: {EVIL}"
    assert tab.evaluate("document.querySelectorAll('img').length") == 0
    assert tab.title() == "addb-viewer watch"
    assert tab.evaluate("document.documentElement.scrollWidth <= innerWidth")
    tab.close()


@pytest.mark.browser
@pytest.mark.parametrize(("width", "height"), [(1920, 1080), (1280, 720), (1024, 768)])
@pytest.mark.parametrize("to_do", ["Nothing to repeat", 5 * "Repeat: step 3 missed plate 2; "])
def test_the_newest_trials_are_listed_and_all_others_summarized(page, browser, width, height, to_do):
    trials = [LINE | {"trial": f"walk_{k}", "to_do": to_do} for k in range(40, 0, -1)]
    page.show(STATE | {"last": trials[0], "trials": trials, "unlisted": ["✗"] * 3 + ["–"]})
    tab = browser.new_page(viewport={"width": width, "height": height})
    tab.goto(page.address)
    tab.wait_for_selector("#trials td")
    rows = tab.locator("#trials tr").count()
    assert 2 <= rows < 39
    assert tab.inner_text("#trials tr:first-child td:nth-child(2)") == "walk_39"  # 40 stands large above
    assert tab.inner_text("#earlier") == (
        f"Earlier: ! {39 - rows} with something to do or to know · ✗ 3 not usable · – 1 not judged"
    )
    box = tab.locator("#earlier").bounding_box()
    assert box["y"] + box["height"] <= height
    page.show(STATE | {"last": trials[0], "trials": trials[:2]})
    tab.wait_for_selector("#earlier", state="hidden")
    assert tab.locator("#trials tr").count() == 1
    tab.close()


def test_no_address_of_another_machine_is_listened_on():
    with pytest.raises(SolverError, match="cannot be listened on"):
        LivePage(socket.inet_ntoa(bytes((192, 0, 2, 1))), 0)
