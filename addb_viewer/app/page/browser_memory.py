"""What a browser remembers of its reviewer: name, theme, and where they were; decisions are in the store."""

import contextlib
import json
import secrets

import viser

from solver.capture.small_files import json_of

ITEM = "addb-viewer"
PATIENCE_S = 3.0  # for the browser's answer


class Remembered:
    """One browser's memory."""

    def __init__(self, client: viser.ClientHandle, suggested: str) -> None:
        """Ask the browser.

        Args:
            client: the browser.
            suggested: name for who has not said one yet.
        """
        self._client, self.suggested = client, suggested
        kept = self._kept()
        self._author = str(kept.get("reviewer") or "")
        self._browser = str(kept.get("browser") or "")
        self._dark = kept.get("dark") is True
        place = kept.get("place")
        known = isinstance(place, list) and len(place) == 2 and all(isinstance(part, str) for part in place)
        self._place: tuple[str, str] | None = (
            (place[0], place[1]) if known and isinstance(place, list) else None
        )
        if not self._browser:
            self._browser = secrets.token_hex(8)
            self._keep()

    @property
    def browser(self) -> str:
        """A random name of the browser itself: two of its pages have the same one."""
        return self._browser

    @property
    def author(self) -> str:
        """Who decides here; empty where nobody has said."""
        return self._author

    @author.setter
    def author(self, name: str) -> None:
        if name != self._author:
            self._author = name
            self._keep()

    @property
    def dark(self) -> bool:
        """Whether the dark theme is on."""
        return self._dark

    @dark.setter
    def dark(self, dark: bool) -> None:
        self._dark = dark
        self._keep()

    @property
    def place(self) -> tuple[str, str] | None:
        """Subject and trial that were on the screen last; None where nothing was."""
        return self._place

    @place.setter
    def place(self, place: tuple[str, str]) -> None:
        if place != self._place:
            self._place = place
            self._keep()

    def _keep(self) -> None:
        kept = {
            "reviewer": self._author,
            "browser": self._browser,
            "dark": self._dark,
            "place": self._place,
        }
        self._client.local_storage.set_item(ITEM, json.dumps(kept))

    def _kept(self) -> dict[str, object]:
        with contextlib.suppress(RuntimeError, TimeoutError, ValueError):  # a browser that keeps nothing
            kept = json_of(self._client.local_storage.get_item(ITEM, timeout=PATIENCE_S) or "{}")
            return kept if isinstance(kept, dict) else {}
        return {}
