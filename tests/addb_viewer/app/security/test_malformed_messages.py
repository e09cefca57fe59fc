"""What no page of ours would send: the terminal shows a line at most, and everybody else goes on."""

import gc
import logging
import math
import socket

import msgspec
import pytest
import viser
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from addb_viewer.app.security.server import open_server
from tests.patience import PATIENCE_S

BROKEN = {
    "text": "hello",
    "empty": b"",
    "no msgpack": b"\xc1\xc1\xc1",
    "cut": msgspec.msgpack.encode({"type": "ViewerCameraMessage", "fov": 1.0})[:-4],
    "nested deeply": b"\x91" * 100_000,
    "a number": msgspec.msgpack.encode(5),
    "a list": msgspec.msgpack.encode([1, 2, 3]),
    "no type": msgspec.msgpack.encode({}),
    "type of a wrong type": msgspec.msgpack.encode({"type": [1]}),
    "unknown type": msgspec.msgpack.encode({"type": "__import__"}),
    "members missing": msgspec.msgpack.encode({"type": "GuiUpdateMessage"}),
    "members too many": msgspec.msgpack.encode({"type": "CommandTriggerMessage", "uuid": "x", "y": 1}),
    "members of wrong types": msgspec.msgpack.encode({"type": "GuiUpdateMessage", "uuid": {}, "updates": 5}),
    "camera of words": msgspec.msgpack.encode(
        {"type": "ViewerCameraMessage"}
        | dict.fromkeys(("wxyz", "position", "look_at", "up_direction"), "word")
        | dict.fromkeys(("fov", "near", "far", "image_height", "image_width"), None)
    ),
    "larger than allowed": bytes(51 * 1024 * 1024),
}


@pytest.fixture(scope="module")
def app(tmp_path_factory, make_replay, make_app):
    app = make_app(tmp_path_factory.mktemp("subject"), [make_replay()], login="Zoë")
    yield app
    app.close()


def stranger(app):
    return connect(
        f"ws://127.0.0.1:{app.server.get_port()}",
        subprotocols=[f"viser-v{viser.__version__}"],
        max_size=None,
        compression=None,
        open_timeout=PATIENCE_S,
    )


@pytest.mark.slow
@pytest.mark.parametrize("broken", BROKEN.values(), ids=BROKEN)
def test_a_broken_message_is_a_line_in_the_terminal_and_nobody_feels_it(app, enter, capfd, caplog, broken):
    browser = enter(app)
    capfd.readouterr()
    caplog.clear()
    with stranger(app) as connection:
        try:
            connection.send(broken)
            connection.send(broken)
            connection.ping(ack_on_close=True).wait(PATIENCE_S)
        except ConnectionClosed:
            pass
    still_works(browser)
    assert_quiet(capfd, caplog)


NOBODYS = (None, -1, 2**63, math.nan, math.inf, b"", [], [1], {}, {"a": [None]}, "x" * 200_000)
WRONG = {  # beside these, for controls of one kind
    viser.GuiButtonHandle: (False, 1, "Play"),
    viser.GuiButtonGroupHandle: (True, 0, "no such button"),
    viser.GuiCheckboxHandle: (0, 1, "yes"),
    viser.GuiDropdownHandle: (True, 0, "no such choice"),
    viser.GuiSliderHandle: (True, "1", 1e9),
    viser.GuiTextHandle: (True, 0),
    viser.GuiNumberHandle: (True, "1", 1e9),
}
RIGHT = {viser.GuiNumberHandle: (-1,)}  # of nobody's values: an offset may be that


def test_wrong_values_for_what_is_on_the_page_are_not_taken(app, enter, capfd, caplog):
    browser = enter(app)
    session = browser.session
    controls = dict(session.notices.client.gui._gui_input_handle_from_uuid)
    kinds = {type(control) for control in controls.values()} & WRONG.keys()
    assert kinds == WRONG.keys()  # the page has some of each

    def everything():
        values = {uuid: (control.value, control._impl.removed) for uuid, control in controls.items()}
        return values, session.review.review, session.review.chosen, session.shown

    before = everything()
    capfd.readouterr()
    caplog.clear()
    for uuid, control in controls.items():
        right = RIGHT.get(type(control), ())
        for value in (v for v in NOBODYS + WRONG.get(type(control), ()) if v not in right):
            browser._say("GuiUpdateMessage", uuid=uuid, updates={"value": value})
        for name in ("removed", "update_cb", "props", "nothing", "__class__"):
            browser._say("GuiUpdateMessage", uuid=uuid, updates={name: 5})
            browser._say("GuiUpdateMessage", uuid=uuid, updates={"value": control.value, name: 5})
    still_works(browser)  # in the order of the messages
    session.notices._hand.submit(lambda: None).result(PATIENCE_S)
    after = everything()
    assert after == before
    assert_quiet(capfd, caplog, lines=len(controls))


@pytest.mark.parametrize(
    "sent",
    [
        b"\x16\x03\x01\x02\x00\x01\x00",
        b"nonsense\r\n\r\n",
        b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nHost: 127.0.0.1\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nUpgrade: websocket\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\n\r\n",
        b"GET " + 10_000 * b"/" + b" HTTP/1.1\r\n\r\n",
    ],
)
def test_what_is_no_request_is_turned_away_without_a_word(app, capfd, caplog, sent):
    with socket.create_connection(("127.0.0.1", app.server.get_port()), timeout=PATIENCE_S) as connection:
        connection.sendall(sent)
        connection.shutdown(socket.SHUT_WR)
        answer = connection.recv(64)
        while connection.recv(65536):
            pass
    assert answer[9:12] in (b"", b"400", b"403", b"426")
    assert_quiet(capfd, caplog, lines=0)


def still_works(browser):
    """A command still does what it should, after all that was said before it."""
    session = browser.session
    to = "First frame" if session.frame else "One frame on"
    was = session.frame
    browser.press_in_palette(to)
    browser.until(lambda: session.frame != was, "the frame")


def assert_quiet(capfd, caplog, lines=1):
    gc.collect()  # a failed task is told of when it goes
    out, err = capfd.readouterr()
    logged = [record for record in caplog.records if record.levelno >= logging.WARNING]
    assert [record.exc_text or record.exc_info for record in logged if record.exc_info] == []
    said = [*(out + err).splitlines(), *(line for r in logged for line in r.getMessage().splitlines())]
    assert len(said) <= lines, said
    assert all(len(line) < 200 for line in said)


def test_the_first_request_may_be_none(capfd, caplog):
    server = open_server(port=0)
    try:
        with socket.create_connection(("127.0.0.1", server.get_port()), timeout=PATIENCE_S) as connection:
            connection.sendall(b"\x16\x03\x01\x02\x00\x01\x00")
            connection.shutdown(socket.SHUT_WR)
            while connection.recv(65536):
                pass
        assert_quiet(capfd, caplog, lines=0)
    finally:
        server.stop()
