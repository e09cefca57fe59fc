"""The door: who may come in. Spoken to as a browser would, byte by byte."""

import base64
import os
import socket

import pytest
import viser
from websockets.datastructures import Headers

from addb_viewer.app.server import AddressError, address, open_server, refusal


@pytest.fixture(scope="module")
def server():
    server = open_server(port=0)
    yield server
    server.stop()


def ask(port, headers, *, websocket):
    """Status of a request with these headers."""
    lines = ["GET / HTTP/1.1", *(f"{k}: {v}" for k, v in headers.items())]
    if websocket:
        key = base64.b64encode(os.urandom(16)).decode()
        lines += ["Upgrade: websocket", "Connection: Upgrade", f"Sec-WebSocket-Key: {key}"]
        lines += ["Sec-WebSocket-Version: 13", f"Sec-WebSocket-Protocol: viser-v{viser.__version__}"]
    with socket.create_connection(("127.0.0.1", port), timeout=10) as door:
        door.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        return int(door.recv(64).split()[1])


def test_the_page_and_its_own_websocket_come_in(server):
    port = server.get_port()
    for host in ("127.0.0.1", "localhost"):
        assert ask(port, {"Host": f"{host}:{port}"}, websocket=False) == 200
        own = {"Host": f"{host}:{port}", "Origin": f"http://{host}:{port}"}
        assert ask(port, own, websocket=True) == 101


@pytest.mark.parametrize("origin", ["http://evil.example", "https://127.0.0.1:1", "null", "file://"])
def test_a_foreign_pages_websocket_is_refused(server, origin):
    port = server.get_port()
    assert ask(port, {"Host": f"127.0.0.1:{port}", "Origin": origin}, websocket=True) == 403


def test_a_name_bound_to_this_machine_by_a_stranger_is_refused(server):
    port = server.get_port()
    rebound = {"Host": f"evil.example:{port}", "Origin": f"http://evil.example:{port}"}
    assert ask(port, rebound, websocket=True) == 403
    assert ask(port, rebound, websocket=False) == 403


def test_a_program_without_a_browser_comes_in(server):
    port = server.get_port()
    assert ask(port, {"Host": f"127.0.0.1:{port}"}, websocket=True) == 101


def test_open_to_the_network_it_answers_to_addresses_but_not_to_strange_names():
    same = {"Host": "192.168.1.5:8080", "Origin": "http://192.168.1.5:8080"}
    assert refusal(Headers(same), "0.0.0.0", websocket=True) is None
    strange = {"Host": "evil.example:8080", "Origin": "http://evil.example:8080"}
    assert refusal(Headers(strange), "0.0.0.0", websocket=True) is not None
    assert refusal(Headers(same), "127.0.0.1", websocket=True) is not None


def test_only_this_machine_is_listened_to(server):
    assert server.get_host() == "127.0.0.1"


def test_sharing_is_off(server):
    with pytest.raises(AddressError):
        server.request_share_url()


def test_a_taken_port_moves_on_and_the_address_says_so(server):
    second = open_server(port=server.get_port())
    try:
        assert second.get_port() != server.get_port()
        assert address(second, "127.0.0.1").endswith(f":{second.get_port()}")
    finally:
        second.stop()


@pytest.mark.parametrize(("host", "port"), [("256.1.1.1", 0), ("no such host", 0), ("127.0.0.1", 70000)])
def test_an_impossible_address_is_one_clear_error(host, port):
    with pytest.raises(AddressError):
        open_server(host, port)


def test_addresses_as_people_type_them(server):
    port = server.get_port()
    assert address(server, "0.0.0.0") == f"http://127.0.0.1:{port}"
    assert address(server, "::1") == f"http://[::1]:{port}"
