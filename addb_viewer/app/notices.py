"""What went wrong, told to the people looking at the app."""

import logging
from collections.abc import Callable, Coroutine
from typing import Any

import viser

from solver.errors import SolverError

LOG = logging.getLogger("addb_viewer")


class Notices:
    """Shows errors as notifications; those that come before anybody looks wait for the first browser."""

    def __init__(self, server: viser.ViserServer) -> None:
        self.server = server
        self.waiting: list[tuple[str, str]] = []
        server.on_client_connect(self._deliver)

    def error(self, doing: str, error: BaseException) -> None:
        """Tell that something failed, and keep going."""
        if isinstance(error, SolverError):
            LOG.warning("%s: %s", doing, error)
        else:
            LOG.error("%s failed", doing, exc_info=error)
        self._show(f"{doing} failed", str(error) or type(error).__name__)

    def tell(self, title: str, body: str) -> None:
        """Tell those who look that something is done."""
        for client in self.server.get_clients().values():
            client.add_notification(title, body, color="teal", auto_close_seconds=8.0)

    def guard(self, doing: str, action: Callable[..., None]) -> Callable[..., None]:
        """The same action, whose exceptions become notifications."""

        def guarded(*arguments: Any) -> None:
            try:
                action(*arguments)
            except Exception as error:  # whatever it is, a person should see it
                self.error(doing, error)

        return guarded

    def in_order(self, doing: str, action: Callable[[], None]) -> Callable[..., Coroutine[Any, Any, None]]:
        """A guarded action for the browser's events that runs in their order, so it must return at once."""
        guarded = self.guard(doing, action)

        async def handle(_event: object) -> None:
            guarded()

        return handle

    def _show(self, title: str, body: str) -> None:
        clients = self.server.get_clients().values()
        if not clients:
            self.waiting.append((title, body))
        for client in clients:
            client.add_notification(title, body, color="red")

    def _deliver(self, client: viser.ClientHandle) -> None:
        waiting, self.waiting = self.waiting, []
        for title, body in waiting:
            client.add_notification(title, body, color="red")
