"""The web server: every request and message is checked, and there is no sharing."""

import asyncio
import contextlib
import http
import io
import logging
import math
import socket
import traceback
from collections.abc import Awaitable, Iterable, Mapping
from typing import Any

import viser
from websockets.asyncio.server import ServerConnection
from websockets.frames import CloseCode
from websockets.http11 import Request, Response

from addb_viewer.app.security import page_policy
from addb_viewer.app.security.access import WILDCARDS, Access
from addb_viewer.app.security.file_parts import ServedFile, answer_part
from addb_viewer.app.security.own_pages import OwnPages
from addb_viewer.app.viser_bridge.private_parts import Handler, Look, Pass, check_updates, guarded_requests
from solver.common.errors import SolverError

LOG = logging.getLogger("addb_viewer")
LONGEST = 100  # characters of what Python says about it: it may hold the whole message
KINDS = 100  # told of at most, however inventive the sender
LONGEST_TEXT = 100_000  # characters; a long note has a thousand
SHOWN = 40  # characters of a refused value, of which strangers send any


class StrayMessages:
    """What came in on one server and could not be understood."""

    def __init__(self) -> None:
        """Nothing has come yet."""
        self._told: set[tuple[str, int]] = set()
        logging.getLogger("websockets.server").addFilter(_no_broken_handshakes)

    def kept_out(self, handler: Handler) -> Handler:
        """The handler of a server's connections, ended with the connection where a message breaks it."""

        async def guarded(connection: ServerConnection) -> None:
            asyncio.get_running_loop().set_exception_handler(self._broken_task)
            try:
                await handler(connection)
            except Exception as error:  # whatever a message can break in viser
                self._tell(error)
                await connection.close(CloseCode.INVALID_DATA, "not a message of this page")

        return guarded

    def _broken_task(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """Viser handles each message in a task of its own, which nobody waits for."""
        error = context.get("exception")
        if isinstance(error, Exception) and "future" in context:
            self._tell(error)
        else:
            loop.default_exception_handler(context)

    def _tell(self, error: Exception) -> None:
        LOG.debug("A stray message", exc_info=error)
        place = traceback.extract_tb(error.__traceback__)[-1]
        kind = (place.filename, place.lineno or 0)
        if kind in self._told or len(self._told) >= KINDS:
            return
        self._told.add(kind)
        why = f"{type(error).__name__}: {error}".replace("\n", " ")[:LONGEST]
        LOG.warning("A browser or program sent a message that the app's page would not (%s).", why)


def _no_broken_handshakes(record: logging.LogRecord) -> bool:
    """Drops what is told of requests that were turned away, or were none."""
    return not record.getMessage().startswith(("opening handshake failed", "connection rejected"))


class AddressError(SolverError):
    """The address cannot be listened on."""


class AppServer(viser.ViserServer):
    """Viser's server, with pages of our own beside its page."""

    own: OwnPages

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Refuse: a recording stays on this machine."""
        raise AddressError("Sharing over the internet is switched off.")


def open_server(host: str = "127.0.0.1", port: int = 8080, access: Access | None = None) -> AppServer:
    """A server that answers only pages that it served itself.

    Viser takes the next free port when this one is taken: read `get_port()`.

    Args:
        host: address to listen on.
        port: 0 lets the system choose.
        access: who may come in; by default everybody on the loopback, elsewhere nobody without a token.

    Raises:
        AddressError: the host is no address of this machine, or the port no port.
        PageError: viser's page is not the one that this app knows.
    """
    _check_address(host, port)
    page_policy.script_hashes()  # an unknown page is an error here, not in the browser
    own = OwnPages()
    look, stray = _look_at_requests(access or Access.of(host), own), StrayMessages()

    def guard(handler: Handler) -> Handler:
        return stray.kept_out(own.in_front_of(handler))

    with guarded_requests(look, guard), contextlib.redirect_stdout(io.StringIO()):
        server = AppServer(host=host, port=port, label="addb-viewer", verbose=False)
    server.own = own
    return server


def address(server: viser.ViserServer, access: Access) -> str:
    """The page's address as a person types it, with the token where one is needed."""
    shown = access.host
    if shown in WILDCARDS:
        shown = socket.gethostname() if access.token else "127.0.0.1"
    place = f"[{shown}]" if ":" in shown else shown
    token = f"/?token={access.token}" if access.token else ""
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


def _look_at_requests(access: Access, own: OwnPages) -> Look:
    """What answers requests: who may not come in is turned away, and our own pages lie beside viser's."""

    def look(
        connection: ServerConnection, request: Request, pass_on: Pass
    ) -> Response | Awaitable[Response] | None:
        if any(len(request.headers.get_all(name)) > 1 for name in ("Host", "Origin", "Upgrade")):
            return connection.respond(http.HTTPStatus.BAD_REQUEST, "A header stands there twice.\n")
        websocket = request.headers.get("Upgrade", "").lower() == "websocket"
        port = connection.local_address[1]
        answer = access.answer(request.headers, request.path, port, websocket=websocket, own=own.has)
        ours = not websocket and own.has(request.path)
        extra = page_policy.headers(request.headers.get("Host", ""), own=ours)
        if ours and answer is None and request.path in own.served:
            return _part(connection, request, own.served[request.path], extra)
        if answer is not None:
            response = connection.respond(answer.status, answer.text + "\n")
            extra += answer.headers
        else:
            file = own.answer(connection, request.path) if ours else None
            passed = file or pass_on()
            if passed is None:
                return None
            response = file or own.with_head(passed)
        for name, value in extra:
            response.headers[name] = value
        return response

    return look


async def _part(
    connection: ServerConnection, request: Request, served: ServedFile, extra: Iterable[tuple[str, str]]
) -> Response:
    response = await answer_part(connection, request, served)
    for name, value in extra:
        response.headers[name] = value
    return response


def guard_controls(gui: viser.GuiApi) -> None:
    """Drop what a browser sends to controls that cannot take it, with a line in the terminal for each."""
    told: list[Any] = []  # controls

    def may_set(control: Any, updates: Mapping[str, Any]) -> bool:
        if updates.keys() == {"value"} and can_have(control, updates["value"]):
            return True
        if not any(control is known for known in told):
            told.append(control)
            LOG.warning(
                "A browser or program sent '%s' what it cannot take (%s): nothing was changed.",
                getattr(control, "label", type(control).__name__),
                repr(updates)[:SHOWN].encode("ascii", "backslashreplace").decode(),
            )
        return False

    check_updates(gui, may_set)


def can_have(control: Any, value: object) -> bool:
    """Whether a person can give this value to the control by mouse and keys.

    Args:
        control: viser's handle; its options and bounds are those of now.
        value: as sent.
    """
    match control:
        case viser.GuiButtonHandle():
            return value is True
        case viser.GuiCheckboxHandle():
            return isinstance(value, bool)
        case viser.GuiButtonGroupHandle() | viser.GuiDropdownHandle():
            return isinstance(value, str) and value in control.options
        case viser.GuiTextHandle():
            return isinstance(value, str) and len(value) <= LONGEST_TEXT
        case viser.GuiSliderHandle() | viser.GuiNumberHandle():
            if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
                return False
            return not (control.min is not None and value < control.min) and not (
                control.max is not None and value > control.max
            )
    return False
