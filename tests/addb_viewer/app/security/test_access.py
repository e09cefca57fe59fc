import http

import pytest
from websockets.datastructures import Headers

from addb_viewer.app.security.access import Access


def answer(access, headers, *, websocket=True, path="/"):
    return access.answer(Headers(headers), path, 8080, websocket=websocket)


def test_open_to_the_network_it_answers_to_addresses_but_not_to_strange_names():
    cookie = {"Cookie": "addb_viewer_8080=t"}
    same = {"Host": "192.168.1.5:8080", "Origin": "http://192.168.1.5:8080", **cookie}
    assert answer(Access("0.0.0.0", "t"), same) is None
    strange = {"Host": "evil.example:8080", "Origin": "http://evil.example:8080", **cookie}
    assert answer(Access("0.0.0.0", "t"), strange) is not None
    assert answer(Access("127.0.0.1"), same) is not None


@pytest.mark.parametrize("host", ["", "[", "[::1", "a b", "127.0.0.1:port"])
def test_torn_requests_are_turned_away_and_break_nothing(host):
    found = answer(Access("192.168.1.5", "t"), {"Host": host, "Cookie": 'a=; =; "; x'})
    assert found is not None
    assert found.status is http.HTTPStatus.FORBIDDEN


def test_the_cookie_is_out_of_reach_for_scripts_and_other_sites():
    found = answer(
        Access("192.168.1.5", "t"), {"Host": "192.168.1.5:8080"}, websocket=False, path="/?token=t"
    )
    headers = dict(found.headers)
    assert headers["Location"] == "/"
    assert "HttpOnly" in headers["Set-Cookie"]
    assert "SameSite" in headers["Set-Cookie"]
