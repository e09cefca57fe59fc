"""The web server: the door is asked about every request, and there is no sharing."""

import contextlib
import http
import io
import socket
import threading
from collections.abc import Callable, Iterator
from typing import Any

import viser
import websockets.asyncio.server
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from addb_viewer.app.security import page_policy
from addb_viewer.app.security.access import WILDCARDS, Door
from addb_viewer.app.security.stray_messages import Handler, StrayMessages
from solver.errors import SolverError

_PATCHING = threading.Lock()


class AddressError(SolverError):
    """The address cannot be listened on."""


def open_server(host: str = "127.0.0.1", port: int = 8080, door: Door | None = None) -> viser.ViserServer:
    """A viser server that answers only pages that it served itself.

    Viser takes the next free port when this one is taken: read `get_port()`.

    Args:
        host: address to listen on.
        port: 0 lets the system choose.
        door: who may come in; by default everybody on the loopback, elsewhere nobody without a token.

    Raises:
        AddressError: the host is no address of this machine, or the port no port.
        PageError: viser's page is not the one that this app knows.
    """
    _check_address(host, port)
    page_policy.script_hashes()  # an unknown page is an error here, not in the browser
    with _PATCHING, _doorkeeper(door or Door.of(host)), contextlib.redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host=host, port=port, label="addb-viewer", verbose=False)
    server.request_share_url = _refuse_to_share  # type: ignore[method-assign]
    return server


def address(server: viser.ViserServer, door: Door) -> str:
    """The page's address as a person types it, with the token where one is needed."""
    shown = door.host
    if shown in WILDCARDS:
        shown = socket.gethostname() if door.token else "127.0.0.1"
    place = f"[{shown}]" if ":" in shown else shown
    token = f"/?token={door.token}" if door.token else ""
    return f"http://{place}:{server.get_port()}{token}"


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
def _doorkeeper(door: Door) -> Iterator[None]:
    """Viser gives no way to look at a request before it does; so its call to `serve` gets our look first."""
    serve = websockets.asyncio.server.serve

    def guarded_serve(
        handler: Handler, *args: Any, process_request: Callable[..., Response | None], **options: Any
    ) -> Any:
        def look(connection: ServerConnection, request: Request) -> Response | None:
            if any(len(request.headers.get_all(name)) > 1 for name in ("Host", "Origin", "Upgrade")):
                return connection.respond(http.HTTPStatus.BAD_REQUEST, "A header stands there twice.\n")
            websocket = request.headers.get("Upgrade", "").lower() == "websocket"
            port = connection.local_address[1]
            answer = door.answer(request.headers, request.path, port, websocket=websocket)
            extra = page_policy.headers(request.headers.get("Host", ""))
            if answer is not None:
                response = connection.respond(answer.status, answer.text + "\n")
                extra += answer.headers
            elif (passed := process_request(connection, request)) is None:
                return None
            else:
                response = passed
            for name, value in extra:
                response.headers[name] = value
            return response

        return serve(StrayMessages().kept_out(handler), *args, process_request=look, **options)

    websockets.asyncio.server.serve = guarded_serve  # type: ignore[assignment, misc]
    try:
        yield
    finally:
        websockets.asyncio.server.serve = serve  # type: ignore[misc]


def _refuse_to_share(verbose: bool = True) -> None:
    raise AddressError("Sharing over the internet is switched off.")
