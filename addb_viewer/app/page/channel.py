"""The channel of our own between one page of a browser and its session, beside viser's connection.

How to use it, from a session (`session.channel`) and in the page (`window.addb`, of `web/channel.js`):

    channel.show("bar", {"trial": "walk"})              addb.on("bar", (bar) => draw(bar))
    channel.on("seek", lambda frame: ...)               addb.send("seek", 57)

What is shown is state: of each kind the page gets the newest value alone, again after it was cut off, and
nothing where it has not changed. So large values that seldom change (rows, curves) and small ones that often
do (the cursor) are kinds of their own. What the page says is an order; it comes from outside, so whoever
takes it checks it. `["do", action]` does what the key of an action does.

A new script is a file in `web/` that `SCRIPTS` names. Scripts and styles come from files alone: the page's
policy runs no text that comes by a message.

The page chooses a random name, and answers with it when viser asks its local storage for `PAGE_ITEM`: so the
server learns which page a session belongs to.
"""

import asyncio
import contextlib
import json
import logging
import re
import secrets
import threading
from collections.abc import Callable
from typing import Any

import viser
from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

from addb_viewer.app.security.file_parts import ServedFile
from addb_viewer.app.security.own_pages import MOST_BYTES, OwnPages
from addb_viewer.app.security.trial_address import TrialAddress, address_in

LOG = logging.getLogger("addb_viewer")
FILES, CONNECTION = "/addb", "/addb/page"
PAGE_ITEM = "addb-viewer-page"  # of the browser's memory, as viser asks for it; the page itself answers
PATIENCE_S = 20.0  # for the browser's answer; without it the page has no channel
SCRIPTS = (
    "focus.js",
    "keys.js",
    "links.js",
    "bar.js",
    "timeline.js",
    "charts.js",
    "diagnosis.js",
    "names.js",
    "scene.js",
    "video.js",
    "film.js",
)
HEAD = "".join(
    (
        *(f"<script src='{FILES}/{name}.js'></script>" for name in ("channel", "redraws")),  # before viser's
        *(
            f"<link rel='stylesheet' href='{FILES}/{name}'>"
            for name in ("strip.css", "charts.css", "diagnosis.css", "video.css")
        ),
        *(f"<script type='module' src='{FILES}/{name}'></script>" for name in SCRIPTS),
    )
)

Taken = Callable[[Any], None]


class Channel:
    """What one page shows of ours, and what it asks for. All methods may be called from any thread."""

    def __init__(self, own: OwnPages | None = None) -> None:
        """Show nothing.

        Args:
            own: pages of the server; None: there is none that could serve files.
        """
        self._own = own or OwnPages()
        self._served: tuple[str, ServedFile | None] = ("", None)  # path and file
        self._lock = threading.Lock()
        self._shown: dict[str, str] = {}
        self._taken: dict[str, Taken] = {}
        self._wake: Callable[[], None] = lambda: None
        self._ended = False

    def show(self, kind: str, value: Any) -> None:
        """What the page shall know from now on.

        Args:
            kind: what it is about.
            value: as JSON can hold it; no NaN.
        """
        text = json.dumps(value, allow_nan=False, separators=(",", ":"))
        with self._lock:
            if self._shown.get(kind) == text:
                return
            self._shown[kind] = text
            wake = self._wake
        wake()

    def shown(self, kind: str) -> Any:
        """What the page knows; None where nothing was said."""
        with self._lock:
            text = self._shown.get(kind)
        return None if text is None else json.loads(text)

    def on(self, kind: str, taken: Taken) -> None:
        """Take what the page asks for; called on the server's loop, so it returns at once.

        Args:
            kind: what it asks.
            taken: gets the value, which may be anything that JSON holds.
        """
        with self._lock:
            self._taken[kind] = taken

    def take(self, kind: object, value: Any) -> None:
        """Do what the page asks for; what nobody takes is dropped."""
        with self._lock:
            taken = self._taken.get(kind) if isinstance(kind, str) else None
        if taken is not None:
            taken(value)

    def serve_file(self, file: ServedFile | None) -> str:
        """Let the page read a file, in place of the one before; None: none.

        Returns:
            The path at which it is, which cannot be guessed.
        """
        with self._lock:
            path, before = self._served
            if before != file:
                self._own.served.pop(path, None)
                path = "" if file is None else f"{FILES}/file/{secrets.token_hex(16)}"
                self._served = path, file
                if file is not None:
                    self._own.served[path] = file
        return path

    def end(self) -> None:
        """The session is over: the page has to ask for another one."""
        self.serve_file(None)
        with self._lock:
            self._ended, wake = True, self._wake
        wake()

    async def serve(self, connection: ServerConnection) -> None:
        """Tell a page until it goes, and hear what it says."""
        loop, changed = asyncio.get_running_loop(), asyncio.Event()

        def wake() -> None:
            with contextlib.suppress(RuntimeError):  # the server ends just now
                loop.call_soon_threadsafe(changed.set)

        with self._lock:
            self._wake = wake
        telling = asyncio.create_task(self._tell(connection, changed))
        try:
            async for text in connection:
                if len(text) <= MOST_BYTES:
                    kind, value = json.loads(text)
                    self.take(kind, value)
        finally:
            telling.cancel()

    async def _tell(self, connection: ServerConnection, changed: asyncio.Event) -> None:
        sent: dict[str, str] = {}
        with contextlib.suppress(ConnectionClosed):
            while True:
                changed.clear()
                with self._lock:
                    news = {kind: text for kind, text in self._shown.items() if sent.get(kind) is not text}
                for kind, text in news.items():
                    await connection.send(f"[{json.dumps(kind)},{text}]")
                sent.update(news)
                if self._ended:
                    await connection.close()
                    return
                await changed.wait()


class Channels:
    """Those of all pages, by the random names that the pages have."""

    def __init__(self, own: OwnPages) -> None:
        """Put our scripts into viser's page, and answer their connections.

        Args:
            own: pages of the server.
        """
        self._own = own
        self._of: dict[str, Channel] = {}
        self._lock = threading.Lock()
        own.add_folder("addb_viewer.app.page.web", FILES, "")
        own.head = HEAD
        own.connections[CONNECTION] = self._serve

    def open(self, page: "Page") -> Channel:
        """The one of a page whose session begins: it shows nothing yet."""
        channel = Channel(self._own)
        if page.name:
            with self._lock:
                before, self._of[page.name] = self._of.get(page.name), channel
            if before is not None:
                before.end()
        return channel

    def close(self, page: "Page", channel: Channel) -> None:
        """The page has gone."""
        with self._lock:
            if self._of.get(page.name) is channel:
                del self._of[page.name]
        channel.end()

    async def _serve(self, connection: ServerConnection) -> None:
        """A page says its name first; one that is not known asks again a little later."""
        with contextlib.suppress(ConnectionClosed):
            name = await connection.recv()
            with self._lock:
                channel = self._of.get(name) if isinstance(name, str) else None
            if channel is not None:
                await channel.serve(connection)


class Page:
    """What a page says of itself when it comes: its random name, and the frame that its address names."""

    def __init__(self, client: viser.ClientHandle) -> None:
        """Ask the browser; a program that is none says nothing."""
        self.name = ""
        self.asked: TrialAddress | None = None
        said: Any = None
        with contextlib.suppress(RuntimeError, TimeoutError, ValueError):
            said = json.loads(client.local_storage.get_item(PAGE_ITEM, timeout=PATIENCE_S) or "null")
        if isinstance(said, dict):
            name, query = said.get("name"), said.get("query")
            self.name = name if isinstance(name, str) and re.fullmatch("[0-9a-f]{32}", name) else ""
            self.asked = address_in(query) if isinstance(query, str) else None
