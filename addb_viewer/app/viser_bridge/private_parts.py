"""How viser answers requests, packs its page and sets controls: reached where it offers no public way.

Viser serves HTTP and its connection by one call to `websockets.asyncio.server.serve`, which it looks up in
that module when a server starts. Its page is one file, with a script that unpacks the client's script and
runs it. What a browser sends to a control comes to a handler of messages, which sets any attribute.
"""

import contextlib
import re
import threading
from collections.abc import Awaitable, Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import viser
import websockets.asyncio.server
import zstandard
from viser import _messages
from viser.infra import ClientId
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from solver.common.errors import SolverError

Handler = Callable[[ServerConnection], Awaitable[None]]
Pass = Callable[[], Response | None]  # what viser answers; None: it lets a connection in
Look = Callable[[ServerConnection, Request, Pass], Response | Awaitable[Response] | None]

Update = _messages.GuiUpdateMessage
_REPLACING = threading.Lock()
_PACKED = re.compile(
    r'<script data-p="(?P<packed>[^"]*)" data-ss="(?P<style>\d+)" data-cs="(?P<script>\d+)">'
    r"(?P<loader>.*?)</script>",
    re.DOTALL,
)
_DIGITS = [c for c in map(chr, range(0x21, 0x7F)) if c not in "\"&<>'`"]  # of the packed script, to base 88


class PageError(SolverError):
    """Viser's page is not the one that this app knows."""


@contextlib.contextmanager
def guarded_requests(look: Look, guard: Callable[[Handler], Handler]) -> Iterator[None]:
    """Let a viser server that starts meanwhile ask about each request first.

    Args:
        look: answers a request, by itself or as viser does.
        guard: wraps viser's handler of connections.
    """
    serve = websockets.asyncio.server.serve

    def guarded_serve(
        handler: Handler, *args: Any, process_request: Callable[..., Response | None], **options: Any
    ) -> Any:
        def answer(connection: ServerConnection, request: Request) -> Response | Awaitable[Response] | None:
            return look(connection, request, lambda: process_request(connection, request))

        return serve(guard(handler), *args, process_request=answer, **options)

    with _REPLACING:
        websockets.asyncio.server.serve = guarded_serve  # type: ignore[assignment, misc]
        try:
            yield
        finally:
            websockets.asyncio.server.serve = serve  # type: ignore[misc]


def page_scripts() -> tuple[bytes, bytes]:
    """The script in viser's page, and the one that it unpacks and runs.

    Raises:
        PageError: the page is built in another way.
    """
    page = Path(viser.__file__).parent / "client" / "build" / "index.html"
    found = _PACKED.search(page.read_text(encoding="utf-8"))
    if found is None:
        raise PageError(
            f"{page}: the page of viser {viser.__version__} is built in another way than that of 1.1.1. "
            "Install that version: pip install viser==1.1.1"
        )
    try:
        unpacked = zstandard.ZstdDecompressor().decompress(_from_base_88(found["packed"]))
    except (KeyError, OverflowError, zstandard.ZstdError) as error:
        raise PageError(
            f"{page}: its script cannot be unpacked ({error}). Install viser again: "
            f"pip install --force-reinstall viser=={viser.__version__}"
        ) from error
    start = int(found["style"])
    return found["loader"].encode(), unpacked[start : start + int(found["script"])]


def _from_base_88(text: str) -> bytes:
    """Five digits hold four bytes; a rest of k digits holds k - 1."""
    value = {digit: k for k, digit in enumerate(_DIGITS)}
    out = bytearray()
    for i in range(0, len(text), 5):
        digits = text[i : i + 5]
        number = 0
        for digit in digits:
            number = 88 * number + value[digit]
        out += number.to_bytes(len(digits) - 1, "big")
    return bytes(out)


def check_updates(gui: viser.GuiApi, may_set: Callable[[Any, Mapping[str, Any]], bool]) -> None:
    """Look at what one browser sends to its controls, before viser sets it.

    Viser would set whatever attribute a message names, to whatever its type makes of the value sent, and
    then call what waits for it.

    Args:
        gui: of the browser; controls that it gets later are looked at as well.
        may_set: gets a control and the new values by attribute; False drops them.
    """
    interface, set_control = gui._websock_interface, gui._handle_gui_updates

    async def checked(client_id: ClientId, message: Update) -> None:
        control = gui._gui_input_handle_from_uuid.get(message.uuid)
        if control is not None and may_set(control, message.updates):  # None: it went meanwhile
            await set_control(client_id, message)

    interface.unregister_handler(Update, set_control)
    interface.register_handler(Update, checked)
