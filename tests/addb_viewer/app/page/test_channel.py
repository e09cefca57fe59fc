"""The channel between a page and its session: newest values alone, and nothing from strangers."""

import json
from types import SimpleNamespace

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from addb_viewer.app.page.channel import Channel, Channels
from addb_viewer.app.security.access import Access
from addb_viewer.app.security.server import open_server
from tests.patience import PATIENCE_S


@pytest.fixture(scope="module", params=[None, "right-token"], ids=["loopback", "token"])
def served(request):
    server = open_server(port=0, access=Access("127.0.0.1", request.param))
    yield server.get_port(), Channels(server.own), request.param
    server.stop()


def open_channel(channels):
    """The channel of a page, whose panel holds its name."""
    pieces = []
    channel = channels.open(SimpleNamespace(gui=SimpleNamespace(add_html=pieces.append)))
    assert channel.name in pieces[0]
    return channel


def join(port, token, name, **options):
    headers = {"Cookie": f"addb_viewer_{port}={token}"} if token else {}
    socket = connect(
        f"ws://127.0.0.1:{port}/addb/page", additional_headers=headers, open_timeout=PATIENCE_S, **options
    )
    socket.send(json.dumps({"name": name, "query": "at=a/walk/12", "memory": {"reviewer": "Ada"}}))
    return socket


def test_a_page_hears_the_newest_of_each_kind_and_is_heard(served):
    port, channels, token = served
    channel, heard = open_channel(channels), []
    channel.on("seek", heard.append)
    channel.show("rows", [1, 2])
    channel.show("cursor", 3)
    channel.show("cursor", 4)
    with join(port, token, channel.name) as socket:
        first = [json.loads(socket.recv(PATIENCE_S)) for _ in range(2)]
        assert sorted(first) == [["cursor", 4], ["rows", [1, 2]]]
        assert channel.greeting().asked.frame == 12
        assert channel.greeting().memory == {"reviewer": "Ada"}
        socket.send(json.dumps(["seek", 57]))
        socket.send(json.dumps(["nobody takes this", 1]))
        channel.show("rows", [1, 2])
        channel.show("cursor", 5)
        assert json.loads(socket.recv(PATIENCE_S)) == ["cursor", 5]
    with join(port, token, channel.name) as again:  # cut off for a moment
        assert len([again.recv(PATIENCE_S) for _ in range(2)]) == 2
        channels.close(channel)
        with pytest.raises(ConnectionClosed):
            again.recv(PATIENCE_S)
    assert heard == [57]


@pytest.mark.parametrize("name", ["f" * 32, None, ["x"]])
def test_a_name_that_no_page_has_hears_nothing(served, name):
    port, _, token = served
    with join(port, token, name) as socket, pytest.raises(ConnectionClosed):
        socket.recv(PATIENCE_S)


def test_strangers_do_not_come_in(served):
    port, _, token = served
    with pytest.raises(Exception, match="403"):
        join(port, token, "f" * 32, origin="http://evil.example")
    if token:
        with pytest.raises(Exception, match="403"):
            join(port, "wrong-token", "f" * 32)


@pytest.mark.parametrize("said", [{}, {"query": 7, "memory": [1]}, {"query": "token=x&at=a/walk/12"}])
def test_a_page_that_says_nonsense_has_neither_address_nor_memory(said):
    channel = Channel()
    channel.greet(said)
    assert (channel.greeting().asked, channel.greeting().memory) == (None, {})
