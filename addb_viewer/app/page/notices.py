"""What went wrong, and what was done, told to the person at one browser."""

import asyncio
import contextlib
import logging
import threading
from collections.abc import Callable, Coroutine
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any

import viser

from addb_viewer.app.page.channel import Channel
from annotations.review_errors import LostLogError, ReviewError
from solver.common.errors import SolverError

LOG = logging.getLogger("addb_viewer")
ASIDE_S, IMPORTANT_S, FAILURE_S = 5.0, 12.0, 20.0  # how long a word stays; failures go with Esc as well
MOST_KEPT = 100  # in the list of all that was told
LONGEST_WORD_S = 10.0  # that the hand waits for a browser whose page is being closed


class NameNeededError(SolverError):
    """Somebody decides who has not said who they are."""

    def __init__(self) -> None:
        super().__init__("a decision needs a name; say yours under Review, 'History'")


@dataclass(frozen=True)
class Notice:
    """Something that was told; the page's bar shows it for some seconds, its list keeps it."""

    number: int
    title: str
    body: str
    at: str  # time of the day
    seconds: float | None  # that it is shown; None: until it is sent away
    error: bool = False
    gone: bool = False  # sent away


class Notices:
    """What one browser is told, and the one hand that does what is asked there, in order."""

    def __init__(
        self,
        client: viser.ClientHandle,
        channel: Channel,
        first: Callable[[], AbstractContextManager[None]] = nullcontext,
    ) -> None:
        """Tell nothing yet.

        Args:
            client: the browser.
            channel: to the page's bar.
            first: entered while the hand does what the person asked for.
        """
        self.client, self._channel, self._first = client, channel, first
        self._name = f"browser {client.client_id}_"
        self._hand = ThreadPoolExecutor(max_workers=1, thread_name_prefix=self._name)
        self._closed = False
        self._ear: asyncio.AbstractEventLoop | None = None  # on which the browser's words arrive
        self.unnamed: Callable[[Callable[[], None]], None] | None = None  # asks for a name, then does it
        self._telling = threading.Lock()
        self._told: list[Notice] = []
        self._number = 0

    def close(self) -> None:
        """Nobody looks any more: end the hand, and tell nothing."""
        self._closed = True
        self._hand.shutdown(wait=False, cancel_futures=True)

    def error(self, doing: str, error: BaseException) -> None:
        """Tell that something failed, and keep going."""
        log_error(doing, error)
        self.failed(doing, str(error) or type(error).__name__, lasting=isinstance(error, LostLogError))

    def failed(self, doing: str, why: str, *, lasting: bool = False) -> None:
        """Tell of a failure that has been logged already; a lasting one stays until Escape."""
        self._tell(f"{doing} failed", why, None if lasting else FAILURE_S, error=True)

    def dismiss(self) -> None:
        """Take out of the bar what was told of failures."""
        with self._telling:
            self._told = [replace(n, gone=n.gone or n.error) for n in self._told]
            self._show()

    def tell(self, title: str, body: str, *, important: bool = False) -> None:
        """Tell that something is done; important: that somebody else did something, or that it failed."""
        self._tell(title, body, IMPORTANT_S if important else ASIDE_S)

    def _tell(self, title: str, body: str, seconds: float | None, *, error: bool = False) -> None:
        if self._closed:
            return
        with self._telling:
            self._number += 1
            now = f"{datetime.now().astimezone():%H:%M:%S}"
            self._told.append(Notice(self._number, title, body, now, seconds, error))
            del self._told[:-MOST_KEPT]
            self._show()

    def _show(self) -> None:
        self._channel.show("notices", [vars(notice) for notice in self._told])

    def guard(self, doing: str, action: Callable[..., None]) -> Callable[..., None]:
        """The same action, whose exceptions become notifications."""

        def guarded(*arguments: Any) -> None:
            try:
                action(*arguments)
            except NameNeededError as error:
                if self.unnamed is None:
                    self.error(doing, error)
                else:
                    self.unnamed(lambda: self.do(doing, lambda: action(*arguments)))
            except Exception as error:  # whatever it is, a person should see it
                self.error(doing, error)

        return guarded

    def in_order(self, doing: str, action: Callable[[], None]) -> Callable[[Any], Coroutine[Any, Any, None]]:
        """A guarded action for the browser's events: one after the other, in the order of the events.

        What the app itself sets is no event of a person's: it is not acted on.
        """

        async def handle(event: Any) -> None:
            if getattr(event, "client", self.client) is not None:
                self.obey(doing, action)

        return handle

    def obey(self, doing: str, action: Callable[[], None]) -> None:
        """Do what the person asks for just now; called on the loop on which the browser's words arrive."""

        def asked() -> None:
            with self._first():
                action()

        self._ear = asyncio.get_running_loop()
        self.do(doing, asked)

    def between_words(self, action: Callable[[], None]) -> None:
        """Do something while nothing that the browser says arrives, and wait for it.

        What is typed while the hand looks at a box and writes into it would be lost.
        """
        if self._ear is None or not self.at_hand:
            action()
            return
        done = threading.Event()

        def do_it() -> None:
            try:
                action()
            finally:
                done.set()

        with contextlib.suppress(RuntimeError):  # the page is being closed
            self._ear.call_soon_threadsafe(do_it)
            done.wait(LONGEST_WORD_S)

    @property
    def at_hand(self) -> bool:
        """Whether it is the hand itself that asks: what it then does is an echo that must not wait."""
        return threading.current_thread().name.startswith(self._name)

    def do(self, doing: str, action: Callable[[], None]) -> None:
        """Do something after all that was asked before; returns at once."""
        if not self._closed:
            with contextlib.suppress(RuntimeError):  # it closed just now
                self._hand.submit(self.guard(doing, action))


def log_error(doing: str, error: BaseException) -> None:
    """Into the terminal; with a traceback where it is not an error of ours with a sentence of its own."""
    if isinstance(error, SolverError | ReviewError):
        LOG.warning("%s: %s", doing, error)
    else:
        LOG.error("%s failed", doing, exc_info=error)
