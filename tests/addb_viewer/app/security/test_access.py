import http

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from websockets.datastructures import Headers

from addb_viewer.app.security.access import Access, TrialAddress, address_in


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


@pytest.mark.parametrize(
    ("asked", "led_to"),
    [
        ("/?at=S1/walk/57", "/?at=S1/walk/57"),
        ("/index.html?at=a%20lab/S1/walk%2F2/0", "/?at=a%20lab/S1/walk%2F2/0"),
        ("/?at=S1/walk/57&websocket=ws://evil.example", "/?at=S1/walk/57"),
        ("/?websocket=ws://evil.example&at=S1/walk/57", "/?at=S1/walk/57"),
        ("/?at=S1/walk/-1", "/"),
        ("/?at=S1/walk", "/"),
        ("/?at=S1/%ff/3", "/"),
        ("/?at=http://evil.example//0", "/"),
    ],
)
def test_of_an_address_only_the_frame_is_kept_also_behind_the_token(asked, led_to):
    own = {"Host": "192.168.1.5:8080"}
    guarded = Access("192.168.1.5", "t")
    parted = "&" if "?" in asked else "?"
    found = answer(guarded, own, websocket=False, path=f"{asked}{parted}token=t")
    assert dict(found.headers)["Location"] == led_to
    inside = own | {"Cookie": "addb_viewer_8080=t"}
    assert answer(guarded, inside, websocket=False, path=led_to) is None  # no redirect goes in a circle
    if asked != led_to:
        assert dict(answer(guarded, inside, websocket=False, path=asked).headers)["Location"] == led_to


def test_an_address_without_the_token_says_nothing_of_what_is_there():
    found = answer(Access("192.168.1.5", "t"), {"Host": "192.168.1.5"}, websocket=False, path="/?at=S/w/1")
    assert found.status is http.HTTPStatus.FORBIDDEN
    assert not found.headers


@given(st.text(min_size=1, max_size=40), st.text(min_size=1, max_size=40), st.integers(0, 10**9 - 1))
def test_an_address_comes_back_whatever_the_names(subject, trial, frame):
    assume(not subject.startswith("/") and not any(0xD800 <= ord(c) < 0xE000 for c in subject + trial))
    said = TrialAddress(subject, trial, frame)
    assert address_in(str(said).removeprefix("/?")) == said
