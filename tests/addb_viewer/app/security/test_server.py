"""The web server: who may come in. Spoken to as a browser would, byte by byte."""

import base64
import http.client
import os
import socket

import pytest
import viser

from addb_viewer.app.security.access import Access
from addb_viewer.app.security.server import AddressError, address, open_server
from tests.patience import PATIENCE_S


@pytest.fixture(scope="module")
def server():
    server = open_server(port=0)
    yield server
    server.stop()


def ask(port, headers, *, websocket, path="/"):
    """Status of a request with these headers."""
    lines = [f"GET {path} HTTP/1.1", *(f"{k}: {v}" for k, v in headers.items())]
    if websocket:
        key = base64.b64encode(os.urandom(16)).decode()
        lines += ["Upgrade: websocket", "Connection: Upgrade", f"Sec-WebSocket-Key: {key}"]
        lines += ["Sec-WebSocket-Version: 13", f"Sec-WebSocket-Protocol: viser-v{viser.__version__}"]
    with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE_S) as connection:
        connection.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        return int(connection.recv(64).split()[1])


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


def test_only_this_machine_is_listened_to(server):
    assert server.get_host() == "127.0.0.1"


def test_sharing_is_off(server):
    with pytest.raises(AddressError):
        server.request_share_url()


def test_a_taken_port_moves_on_and_the_address_says_so(server):
    second = open_server(port=server.get_port())
    try:
        assert second.get_port() != server.get_port()
        assert address(second, Access("127.0.0.1")).endswith(f":{second.get_port()}")
    finally:
        second.stop()


@pytest.mark.parametrize(("host", "port"), [("256.1.1.1", 0), ("no such host", 0), ("127.0.0.1", 70000)])
def test_an_impossible_address_is_one_clear_error(host, port):
    with pytest.raises(AddressError):
        open_server(host, port)


def test_addresses_as_people_type_them(server):
    port = server.get_port()
    assert address(server, Access("127.0.0.1")) == f"http://127.0.0.1:{port}"
    assert address(server, Access("::1")) == f"http://[::1]:{port}"
    assert address(server, Access("192.168.1.5", "abc")) == f"http://192.168.1.5:{port}/?token=abc"
    assert address(server, Access("0.0.0.0", "abc")) == f"http://{socket.gethostname()}:{port}/?token=abc"


@pytest.fixture(scope="module")
def guarded():
    """A server that asks for a token, as on any other host than the loopback."""
    server = open_server(port=0, access=Access("127.0.0.1", "right"))
    yield server
    server.stop()


def test_with_a_token_nobody_comes_in_without_it(guarded):
    port = guarded.get_port()
    own = {"Host": f"127.0.0.1:{port}"}
    for path in ("/", "/?token=wrong", "/?token=", "/index.html?tok=right"):
        assert ask(port, own, websocket=False, path=path) == 403
    assert ask(port, own, websocket=True) == 403
    assert ask(port, own | {"Cookie": f"addb_viewer_{port}=wrong"}, websocket=True) == 403
    assert ask(port, own | {"Cookie": "addb_viewer_1=right"}, websocket=True) == 403


def test_the_token_is_exchanged_for_a_cookie_that_opens_page_and_connection(guarded):
    port = guarded.get_port()
    own = {"Host": f"127.0.0.1:{port}"}
    assert ask(port, own, websocket=False, path="/?token=right") == 303
    with_cookie = own | {"Cookie": f"other=1; addb_viewer_{port}=right"}
    assert ask(port, with_cookie, websocket=False) == 200
    assert ask(port, with_cookie | {"Origin": f"http://127.0.0.1:{port}"}, websocket=True) == 101
    assert ask(port, with_cookie | {"Origin": "http://evil.example"}, websocket=True) == 403


@pytest.mark.parametrize(
    "path", ["/" + 5000 * "a", "/%00", "/../pyproject.toml", "/%2e%2e/x", "/assets", "//x", "//x?y"]
)
def test_there_is_nothing_but_the_page(server, path):
    port = server.get_port()
    assert ask(port, {"Host": f"127.0.0.1:{port}"}, websocket=False, path=path) == 404


@pytest.mark.parametrize("path", ["/?websocket=ws://x", "/?x", "/index.html", "/index.html?x"])
def test_nothing_in_the_address_reaches_the_page(server, path):
    status, headers = told(server.get_port(), path)
    assert (status, headers["location"]) == (303, "/")


def test_every_answer_tells_the_browser_to_stay_here(server):
    port = server.get_port()
    for path in ("/", "/nothing", "/?x"):
        _, headers = told(port, path)
        policy = dict(part.split(" ", 1) for part in headers["content-security-policy"].split("; "))
        assert policy["default-src"] == "'none'"
        assert policy["connect-src"] == f"'self' ws://127.0.0.1:{port} wss://127.0.0.1:{port} data: blob:"
        assert policy["frame-ancestors"] == "'none'"
        assert "'unsafe-inline'" not in policy["script-src"]
        assert headers["x-content-type-options"] == "nosniff"


def told(port, path):
    """Status and headers of a page."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE_S)
    connection.request("GET", path)
    response = connection.getresponse()
    response.read()
    connection.close()
    return response.status, {name.lower(): value for name, value in response.getheaders()}


def test_other_hosts_than_the_loopback_get_a_token_by_themselves():
    assert Access.of("127.0.0.1").token is None
    assert Access.of("::1").token is None
    assert Access.of("localhost").token is None
    tokens = {Access.of(host).token for host in ("0.0.0.0", "::", "192.168.1.5", "", "lab.example")}
    assert len(tokens) == 5
    assert all(token and len(token) >= 43 for token in tokens)  # 32 bytes
