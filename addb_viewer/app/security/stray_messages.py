"""Messages that no page of this app sends: the terminal tells of each kind once, and the app goes on."""

import asyncio
import logging
import traceback
from collections.abc import Awaitable, Callable
from typing import Any

from websockets.asyncio.server import ServerConnection
from websockets.frames import CloseCode

LOG = logging.getLogger("addb_viewer")
LONGEST = 100  # characters of what Python says about it: it may hold the whole message
KINDS = 100  # told of at most, however inventive the sender

Handler = Callable[[ServerConnection], Awaitable[None]]


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
