"""Parts of a file over HTTP: at most so much, from any place, and behind the same door as everything else."""

import http.client

import pytest

from addb_viewer.app.page.channel import Channel
from addb_viewer.app.security import file_parts
from addb_viewer.app.security.access import Access
from addb_viewer.app.security.file_parts import ServedFile, part
from addb_viewer.app.security.server import open_server
from tests.patience import PATIENCE_S

MB = 2**20


@pytest.mark.parametrize(
    ("asked", "size", "found"),
    [
        ("bytes=0-", 10 * MB, (0, 4 * MB)),
        ("bytes=4194304-", 10 * MB, (4 * MB, 8 * MB)),
        ("bytes=5-9", 100, (5, 10)),
        ("bytes=90-500", 100, (90, 100)),
        ("bytes=-10", 100, (90, 100)),
        ("bytes=-500", 100, (0, 100)),
        (None, 100, (0, 100)),
        (None, 5 * MB, None),
        ("bytes=100-", 100, None),
        ("bytes=9-5", 100, None),
        ("bytes=-", 100, None),
        ("bytes=0-1,5-6", 100, None),
        ("lines=0-1", 100, None),
        ("bytes=99999999999999999999-", 100, None),
    ],
)
def test_what_is_asked_for_is_what_comes_up_to_four_megabytes(asked, size, found):
    assert part(asked, size) == found


@pytest.fixture
def film(tmp_path):
    file = tmp_path / "film.mp4"
    file.write_bytes(bytes(range(256)) * 40)
    return file


@pytest.fixture(params=[None, "right-token"])
def door(request):
    access = Access("127.0.0.1", request.param)
    server = open_server(port=0, access=access)
    yield server, request.param
    server.stop()


def ask(server, path, token, **headers):
    connection = http.client.HTTPConnection("127.0.0.1", server.get_port(), timeout=PATIENCE_S)
    if token:
        headers["Cookie"] = f"addb_viewer_{server.get_port()}={token}"
    connection.request("GET", path, headers=headers)
    response = connection.getresponse()
    return response, response.read()


def test_a_file_is_served_in_parts_while_its_page_shows_it_and_to_nobody_else(door, film, monkeypatch):
    server, token = door
    monkeypatch.setattr(file_parts, "MOST_BYTES", 1000)
    channel = Channel(server.own)
    path = channel.serve_file(ServedFile(film, "video/mp4"))
    assert path == channel.serve_file(ServedFile(film, "video/mp4")), "the same file stays where it is"
    response, content = ask(server, path, token, Range="bytes=300-")
    assert response.status == 206
    assert content == film.read_bytes()[300:1300]
    assert response.headers["Content-Range"] == "bytes 300-1299/10240"
    assert response.headers["Content-Type"] == "video/mp4"
    assert "default-src 'none'" in response.headers["Content-Security-Policy"]
    assert ask(server, path, token)[0].status == 416
    assert ask(server, path, token, Range="bytes=10240-")[0].status == 416
    assert ask(server, path, token, Host="evil.example", Range="bytes=0-")[0].status == 403
    if token:
        assert ask(server, path, None, Range="bytes=0-")[0].status == 403
    assert ask(server, path[:-1], token, Range="bytes=0-")[0].status == 404
    film.unlink()
    assert ask(server, path, token, Range="bytes=0-")[0].status == 404
    channel.end()
    assert server.own.served == {}
