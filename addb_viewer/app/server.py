"""The web server: this machine only, no foreign web page, no sharing."""

import contextlib
import http
import io
import ipaddress
import socket
import threading
from collections.abc import Callable, Iterator
from typing import Any
from urllib.parse import urlsplit

import viser
import websockets.asyncio.server
from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from solver.errors import SolverError

_PATCHING = threading.Lock()
_WILDCARDS = ("0.0.0.0", "::", "")


class AddressError(SolverError):
    """The address cannot be listened on."""


def open_server(host: str = "127.0.0.1", port: int = 8080) -> viser.ViserServer:
    """A viser server that answers only pages that it served itself.

    Viser takes the next free port when this one is taken: read `get_port()`.

    Args:
        host: address to listen on; others than the loopback let the network in, without a password.
        port: 0 lets the system choose.

    Raises:
        AddressError: the host is no address of this machine, or the port no port.
    """
    _check_address(host, port)
    with _PATCHING, _doorkeeper(host), contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host=host, port=port, label="addb-viewer", verbose=False)
    server.request_share_url = _refuse_to_share  # type: ignore[method-assign]
    return server


def address(server: viser.ViserServer, host: str) -> str:
    """The page's address as a person on this machine types it."""
    shown = "127.0.0.1" if host in _WILDCARDS else host
    return f"http://[{shown}]:{server.get_port()}" if ":" in shown else f"http://{shown}:{server.get_port()}"


def refusal(headers: Headers, host: str, *, websocket: bool) -> str | None:
    """Why a request is turned away: it asks for another machine (a rebound name), or another page sent it.

    A program without a browser sends no Origin and may come in; it could open a connection of its own anyway.
    """
    asked = headers.get("Host", "")
    name = urlsplit(f"//{asked}").hostname or ""
    if not _is_ours(name, host):
        return f"This server does not answer for '{name}'."
    origin = headers.get("Origin")
    if websocket and origin is not None and urlsplit(origin).netloc.lower() != asked.lower():
        return "Only pages of this server may connect."
    return None


def _is_ours(name: str, host: str) -> bool:
    if name in ("localhost", "127.0.0.1", "::1", host.lower()):
        return True
    if host not in _WILDCARDS:
        return False
    with contextlib.suppress(ValueError):
        return bool(ipaddress.ip_address(name))
    return name in (socket.gethostname().lower(), socket.getfqdn().lower())


def _check_address(host: str, port: int) -> None:
    if not 0 <= port <= 65535:
        raise AddressError(f"Port {port}: ports go from 0 to 65535.")
    try:
        found = socket.getaddrinfo(host or None, 0, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
        family, kind, _, _, where = found[0]
        with socket.socket(family, kind) as trial:
            trial.bind(where)
    except OSError as error:
        raise AddressError(
            f"Host '{host}' is no address of this machine ({error.strerror or error})."
        ) from error


@contextlib.contextmanager
def _doorkeeper(host: str) -> Iterator[None]:
    """Viser gives no way to look at a request before it does; so its call to `serve` gets our look first."""
    serve = websockets.asyncio.server.serve

    def guarded_serve(*args: Any, process_request: Callable[..., Response | None], **options: Any) -> Any:
        def look(connection: ServerConnection, request: Request) -> Response | None:
            websocket = request.headers.get("Upgrade", "").lower() == "websocket"
            why = refusal(request.headers, host, websocket=websocket)
            if why is not None:
                return connection.respond(http.HTTPStatus.FORBIDDEN, why + "\n")
            return process_request(connection, request)

        return serve(*args, process_request=look, **options)

    websockets.asyncio.server.serve = guarded_serve  # type: ignore[assignment, misc]
    try:
        yield
    finally:
        websockets.asyncio.server.serve = serve  # type: ignore[misc]


def _refuse_to_share(verbose: bool = True) -> None:
    raise AddressError("Sharing over the internet is switched off.")
