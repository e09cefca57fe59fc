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

The session puts a random name into the page, as a piece of a panel. Whoever connects with that name is the
page, and says what its address asks for and what the browser remembers of the reviewer.
"""

import asyncio
import contextlib
import json
import logging
import secrets
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import viser
from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

from addb_viewer.app.security.access import TrialAddress, address_in
from addb_viewer.app.security.file_parts import ServedFile
from addb_viewer.app.security.own_pages import MOST_BYTES, OwnPages

LOG = logging.getLogger("addb_viewer")
FILES, CONNECTION = "/addb", "/addb/page"
PATIENCE_S = 20.0  # for the page's first word; a program that is no page says none
SCRIPTS = (
    "channel.js",
    "focus.js",
    "keys.js",
    "links.js",
    "bar.js",
    "dialog.js",
    "timeline.js",
    "charts.js",
    "diagnosis.js",
    "video.js",
    "film.js",
    "names.js",
    "scene.js",
)
STYLES = ("viser.css", "strip.css", "charts.css", "diagnosis.css")
HEAD = "".join(
    (
        *(f"<link rel='stylesheet' href='{FILES}/{name}'>" for name in STYLES),
        *(f"<script type='module' src='{FILES}/{name}'></script>" for name in SCRIPTS),
    )
)

Taken = Callable[[Any], None]


@dataclass(frozen=True)
class Greeting:
    """What a page says of itself when it comes."""

    asked: TrialAddress | None = None  # the frame that its address names
    dark: bool = False  # its system wishes dark pages
    memory: Mapping[str, Any] = field(default_factory=dict)  # what the browser remembers, as it says


class Channel:
    """What one page shows of ours, and what it asks for. All methods may be called from any thread."""

    def __init__(self, own: OwnPages | None = None) -> None:
        """Show nothing.

        Args:
            own: pages of the server; None: there is none that could serve files.
        """
        self._own = own or OwnPages()
        self.name = secrets.token_hex(16)
        self._greeting, self._greeted = Greeting(), threading.Event()
        self._served: tuple[str, ServedFile | None] = ("", None)  # path and file
        self._lock = threading.Lock()
        self._shown: dict[str, str] = {}
        self._taken: dict[str, Taken] = {}
        self._wake: Callable[[], None] = lambda: None
        self._ended = False

    def greet(self, said: Mapping[str, Any]) -> None:
        """The page has come; what it says is from outside."""
        query, memory = said.get("query"), said.get("memory")
        asked = address_in(query) if isinstance(query, str) else None
        kept = memory if isinstance(memory, dict) else {}
        self._greeting = Greeting(asked, said.get("dark") is True, kept)
        self._greeted.set()

    def greeting(self) -> Greeting:
        """What the page says of itself; waits for it, and gives an empty one where no page comes."""
        self._greeted.wait(PATIENCE_S)
        return self._greeting

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
        own.add_folder("addb_viewer.app.viser_bridge.web", FILES, "")
        own.head = HEAD
        own.connections[CONNECTION] = self._serve

    def open(self, client: viser.ClientHandle) -> Channel:
        """One for a page whose session begins: it shows nothing yet."""
        channel = Channel(self._own)
        with self._lock:
            self._of[channel.name] = channel
        client.gui.add_html(f"<div data-addb-page='{channel.name}'></div>")
        return channel

    def close(self, channel: Channel) -> None:
        """The page has gone."""
        with self._lock:
            self._of.pop(channel.name, None)
        channel.end()

    async def _serve(self, connection: ServerConnection) -> None:
        """A page says its name first; one whose session has ended asks again a little later."""
        with contextlib.suppress(ConnectionClosed):
            said = json.loads(await connection.recv())
            name = said.get("name") if isinstance(said, dict) else None
            with self._lock:
                channel = self._of.get(name) if isinstance(name, str) else None
            if channel is not None:
                channel.greet(said)
                await channel.serve(connection)
