"""The viewer's server: this machine only, this page only."""

import http.client
import tempfile
import threading
import time
from pathlib import Path

import pytest

from addb_viewer.recordings.rrd_server import RrdServer, ViewerError, ViewerFiles, viewer_files
from tests.patience import PATIENCE_S

PAGE = ViewerFiles({"/": b"<html>viewer</html>", "/re_viewer.js": b"js", "/re_viewer_bg.wasm": b"\0asm"})


@pytest.fixture
def server(tmp_path):
    file = tmp_path / "walk.rrd"
    file.write_bytes(b"RRF2 recording")
    server = RrdServer(file, PAGE)
    threading.Thread(target=server.serve, daemon=True).start()
    yield server
    server.close()


def asked(server, path, host=None):
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=PATIENCE_S)
    connection.request("GET", path, headers={"Host": host or f"127.0.0.1:{server.port}"})
    answer = connection.getresponse()
    return answer.status, answer.headers, answer.read()


def test_the_page_gets_the_recording_from_where_it_came(server):
    assert server.url.startswith(
        f"http://127.0.0.1:{server.port}/?url=http%3A%2F%2F127.0.0.1%3A{server.port}"
    )
    status, headers, content = asked(server, "/?url=x")
    assert (status, content) == (200, b"<html>viewer</html>")
    assert headers["Content-Type"].startswith("text/html")
    assert asked(server, "/recording.rrd")[2] == b"RRF2 recording"
    assert asked(server, "/re_viewer_bg.wasm")[1]["Content-Type"] == "application/wasm"


def test_the_page_may_reach_nothing_else(server):
    policy = asked(server, "/")[1]["Content-Security-Policy"]
    rules = dict(rule.strip().split(" ", 1) for rule in policy.split(";"))
    assert rules["default-src"] == "'none'"
    assert rules["connect-src"] == "'self' data: blob:"
    assert "http" not in policy
    assert "*" not in policy


@pytest.mark.parametrize("host", ["evil.example", "evil.example:80", "127.0.0.1.evil.example", "0.0.0.0"])
def test_another_name_for_this_machine_is_refused(server, host):
    status, headers, content = asked(server, "/recording.rrd", host=host)
    assert status == 403
    assert b"RRF2" not in content
    assert "Access-Control-Allow-Origin" not in headers


@pytest.mark.parametrize("path", ["/etc/passwd", "/../walk.rrd", "/walk.rrd"])
def test_nothing_else_is_handed_out(server, path):
    assert asked(server, path)[0] == 404


def test_a_port_that_is_taken_is_named(server, tmp_path):
    with pytest.raises(ViewerError, match=str(server.port)):
        RrdServer(tmp_path / "walk.rrd", PAGE, server.port)


def test_it_listens_on_this_machine_alone(server):
    assert server._server.server_address[0] == "127.0.0.1"


def test_reruns_own_viewer_is_found_and_its_program_ended(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    files = viewer_files().files
    assert b"re_viewer.js" in files["/"]
    assert files["/re_viewer_bg.wasm"][:4] == b"\0asm"
    deadline = time.monotonic() + PATIENCE_S
    while ours := [p for p in Path("/proc").glob("[0-9]*/environ") if _mentions(p, tmp_path)]:
        assert time.monotonic() < deadline, f"still running with our settings folder: {ours}"
        time.sleep(0.05)


def _mentions(environ, folder):
    try:
        return f"XDG_CONFIG_HOME={folder}".encode() in environ.read_bytes()
    except OSError:
        return False
