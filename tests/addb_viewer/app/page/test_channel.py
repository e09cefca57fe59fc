"""The channel between a page and its session: newest values alone, and nothing from strangers."""

import json

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from addb_viewer.app.page.channel import Channels, Page
from addb_viewer.app.security.access import Access
from addb_viewer.app.security.server import open_server
from tests.patience import PATIENCE_S

NAME = "0123456789abcdef" * 2


class AnsweringClient:
    """Viser's side of a browser whose page answers what its memory is asked for."""

    def __init__(self, said):
        self.said, self.local_storage = said, self

    def get_item(self, item, timeout):
        return self.said


@pytest.fixture(scope="module", params=[None, "right-token"], ids=["loopback", "token"])
def served(request):
    server = open_server(port=0, access=Access("127.0.0.1", request.param))
    yield server.get_port(), Channels(server.own), request.param
    server.stop()


def page_of(name=NAME, query=""):
    return Page(AnsweringClient(json.dumps({"name": name, "query": query})))


def join(port, token, name=NAME, **options):
    headers = {"Cookie": f"addb_viewer_{port}={token}"} if token else {}
    socket = connect(
        f"ws://127.0.0.1:{port}/addb/page", additional_headers=headers, open_timeout=PATIENCE_S, **options
    )
    socket.send(name)
    return socket


def test_a_page_hears_the_newest_of_each_kind_and_is_heard(served):
    port, channels, token = served
    page, heard = page_of(), []
    channel = channels.open(page)
    channel.on("seek", heard.append)
    channel.show("rows", [1, 2])
    channel.show("cursor", 3)
    channel.show("cursor", 4)
    with join(port, token) as socket:
        first = [json.loads(socket.recv(PATIENCE_S)) for _ in range(2)]
        assert sorted(first) == [["cursor", 4], ["rows", [1, 2]]]
        socket.send(json.dumps(["seek", 57]))
        socket.send(json.dumps(["nobody takes this", 1]))
        channel.show("rows", [1, 2])
        channel.show("cursor", 5)
        assert json.loads(socket.recv(PATIENCE_S)) == ["cursor", 5]
    with join(port, token) as again:  # cut off for a moment
        assert len([again.recv(PATIENCE_S) for _ in range(2)]) == 2
        channels.close(page, channel)
        with pytest.raises(ConnectionClosed):
            again.recv(PATIENCE_S)
    assert heard == [57]


def test_a_name_that_no_page_has_hears_nothing(served):
    port, _, token = served
    with join(port, token, "f" * 32) as socket, pytest.raises(ConnectionClosed):
        socket.recv(PATIENCE_S)


def test_strangers_do_not_come_in(served):
    port, _, token = served
    with pytest.raises(Exception, match="403"):
        join(port, token, origin="http://evil.example")
    if token:
        with pytest.raises(Exception, match="403"):
            join(port, "wrong-token")


@pytest.mark.parametrize("said", [None, "", "{", "[]", '{"name": "../x", "query": 7}'])
def test_a_page_that_answers_nonsense_has_no_name(said):
    page = Page(AnsweringClient(said))
    assert (page.name, page.asked) == ("", None)


def test_the_address_of_a_page_names_a_frame():
    assert page_of(query="at=a/b/walk/12").asked.frame == 12
    assert page_of(query="token=x&at=a/walk/12").asked is None
