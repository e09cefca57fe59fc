"""Who may come in: pages of this server alone, and, when the network can reach it, only who has the token.

Its page takes nothing from its address but the frame to show: viser's would listen to any server named there
(`?websocket=`, `?playbackPath=`), and run what that one sends.
"""

import contextlib
import hmac
import http
import ipaddress
import secrets
import socket
from collections.abc import Callable
from dataclasses import dataclass
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs, quote, unquote, urlsplit

from websockets.datastructures import Headers

OPTION = "at"
LONGEST = 2000  # characters of an address; browsers and proxies take that much


@dataclass(frozen=True)
class TrialAddress:
    """A frame of a trial; a folder's name in the subject may hold slashes, a trial's stands escaped."""

    subject: str
    trial: str
    frame: int = 0

    def __str__(self) -> str:
        """What stands in the address behind the server's name."""
        return f"/?{OPTION}={quote(self.subject, safe='/')}/{quote(self.trial, safe='')}/{self.frame}"


def address_in(query: str) -> TrialAddress | None:
    """The one that a query says and nothing else; None where there is none, or anything beside it.

    Args:
        query: as it stands behind the `?`.
    """
    option, _, value = query.partition("=")
    if option != OPTION or "&" in value or len(value) > LONGEST:
        return None
    subject, _, rest = value.rpartition("/")[0].rpartition("/")
    frame = value.rpartition("/")[2]
    if not (subject and rest and frame.isascii() and frame.isdigit() and len(frame) <= 9):
        return None
    try:
        return TrialAddress(unquote(subject, errors="strict"), unquote(rest, errors="strict"), int(frame))
    except UnicodeDecodeError:
        return None


def wished_in(query: str) -> TrialAddress | None:
    """The first one among a query's options, whatever else it says."""
    return next((found for part in query.split("&") if (found := address_in(part)) is not None), None)


WILDCARDS = ("0.0.0.0", "::", "")
TOKEN_BYTES = 32
PAGE = "/"
_LOOPBACK_NAMES = ("localhost", "127.0.0.1", "::1")


@dataclass(frozen=True)
class Answer:
    """What a request gets in place of what it asked for."""

    status: http.HTTPStatus
    text: str
    headers: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Access:
    """The rules of one server."""

    host: str  # that it listens on
    token: str | None = None  # that browsers must bring; None: who reaches the port is this machine

    @classmethod
    def of(cls, host: str) -> "Access":
        """Open on the loopback, with a new token on any other address."""
        return cls(host, None if is_loopback(host) else secrets.token_urlsafe(TOKEN_BYTES))

    def answer(
        self,
        headers: Headers,
        path: str,
        port: int,
        *,
        websocket: bool,
        own: Callable[[str], bool] = lambda path: False,
    ) -> Answer | None:
        """How a request is turned away or sent on; None lets it in.

        The first page is asked for with the token in its address, which the browser then keeps as a cookie,
        so that the token stays neither in the address bar nor in the history of pages. The frame that the
        address names is kept on the way.

        Args:
            headers: of the request.
            path: that it asks for, with its query.
            port: that it came to.
            websocket: whether it wants a connection and not a page.
            own: whether a path is that of a page of our own, beside viser's.
        """
        why = self._foreign(headers, websocket=websocket)
        if why is not None:
            return Answer(http.HTTPStatus.FORBIDDEN, why)
        if self.token is None or self._is_token(_cookie(headers, port)):
            return None if websocket or own(path) else _only_a_page(path, own)
        brought = parse_qs(urlsplit(path).query).get("token", [""])[0]
        if not self._is_token(brought):
            return Answer(
                http.HTTPStatus.FORBIDDEN,
                "Open the address that the terminal printed, with the token at its end.",
            )
        if websocket:
            return None
        kept = f"{_cookie_name(port)}={self.token}; HttpOnly; SameSite=Lax; Path=/"
        return Answer(http.HTTPStatus.SEE_OTHER, "", (("Location", _wished(path, own)), ("Set-Cookie", kept)))

    def _foreign(self, headers: Headers, *, websocket: bool) -> str | None:
        """Why a request is turned away: it asks for another machine, a rebound name, or another page sent it.

        A program without a browser sends no Origin and may come in; it could open a connection of its own.
        """
        asked = headers.get("Host", "")
        name = _hostname(asked)
        if not self._is_ours(name):
            return f"This server does not answer for '{name}'."
        origin = headers.get("Origin")
        if websocket and origin is not None and urlsplit(origin).netloc.lower() != asked.lower():
            return "Only pages of this server may connect."
        return None

    def _is_ours(self, name: str) -> bool:
        if name in (*_LOOPBACK_NAMES, self.host.lower()):
            return True
        if self.host not in WILDCARDS:
            return False
        with contextlib.suppress(ValueError):
            return bool(ipaddress.ip_address(name))
        return name in (socket.gethostname().lower(), socket.getfqdn().lower())

    def _is_token(self, brought: str) -> bool:
        assert self.token is not None
        return hmac.compare_digest(brought.encode(), self.token.encode())


def _only_a_page(path: str, own: Callable[[str], bool]) -> Answer | None:
    """Viser's page, with nothing in its address but a frame; None where just that is asked for."""
    place, _, options = path.partition("?")
    if place not in (PAGE, "/index.html") and not own(place):
        return Answer(http.HTTPStatus.NOT_FOUND, "There is nothing here. The app is at the address's root.")
    if place == PAGE and (not options or address_in(options) is not None):
        return None
    return Answer(http.HTTPStatus.SEE_OTHER, "", (("Location", _wished(path, own)),))


def _wished(path: str, own: Callable[[str], bool]) -> str:
    """The page that is asked for, viser's at the frame that an address names; nothing else is kept."""
    place, _, options = path.partition("?")
    if own(place):
        return place
    found = wished_in(options)
    return PAGE if found is None else str(found)


def is_loopback(host: str) -> bool:
    """Whether nobody but this machine can reach an address."""
    if host == "localhost":
        return True
    with contextlib.suppress(ValueError):
        return ipaddress.ip_address(host).is_loopback
    return False


def _hostname(asked: str) -> str:
    with contextlib.suppress(ValueError):
        return urlsplit(f"//{asked}").hostname or ""
    return ""


def _cookie_name(port: int) -> str:
    """Cookies are shared by all ports of a machine."""
    return f"addb_viewer_{port}"


def _cookie(headers: Headers, port: int) -> str:
    jar: SimpleCookie = SimpleCookie()
    for line in headers.get_all("Cookie"):
        with contextlib.suppress(CookieError):
            jar.load(line)
    found = jar.get(_cookie_name(port))
    return found.value if found is not None else ""
