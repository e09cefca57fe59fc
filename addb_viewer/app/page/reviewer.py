"""The reviewer at one browser: what it remembers of them (name, theme, trial), and asking for the name."""

import html
import secrets
from collections.abc import Callable
from typing import Any

import viser

from addb_viewer.app.page.channel import Channel
from addb_viewer.app.page.notices import NameNeededError
from addb_viewer.app.page.questions import Questions
from addb_viewer.app.subjects.people import People
from addb_viewer.trial_view.html_pieces import boxed


class BrowserMemory:
    """One browser's memory."""

    def __init__(self, channel: Channel, suggested: str) -> None:
        """Ask the browser.

        Args:
            channel: to the page, which keeps it.
            suggested: name for who has not said one yet.
        """
        self._channel, self.suggested = channel, suggested
        kept = channel.greeting().memory
        self._author = str(kept.get("reviewer") or "")
        self._browser = str(kept.get("browser") or "") or secrets.token_hex(8)
        self._dark = kept.get("dark") is True
        place = kept.get("place")
        known = isinstance(place, list) and len(place) == 2 and all(isinstance(part, str) for part in place)
        self._place: tuple[str, str] | None = (
            (place[0], place[1]) if known and isinstance(place, list) else None
        )
        curves = kept.get("curves")
        self._curves: dict[str, Any] = curves if isinstance(curves, dict) else {}
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

    @property
    def curves(self) -> dict[str, Any]:
        """What was chosen in the tab of curves, as the browser gave it; empty where nothing was."""
        return self._curves

    @curves.setter
    def curves(self, curves: dict[str, Any]) -> None:
        self._curves = curves
        self._keep()

    def _keep(self) -> None:
        kept = {
            "reviewer": self._author,
            "browser": self._browser,
            "dark": self._dark,
            "place": self._place,
            "curves": self._curves,
        }
        self._channel.show("memory", kept)


class Reviewer:
    """The name of the person at one page."""

    def __init__(
        self,
        memory: BrowserMemory,
        questions: Questions,
        people: People,
        page: int,
        shown: viser.GuiHtmlHandle,
    ) -> None:
        self._memory, self._questions, self._people = memory, questions, people
        self._page, self._shown = page, shown
        self._show()

    @property
    def name(self) -> str:
        """Empty where nobody has said."""
        return self._memory.author

    @property
    def browser(self) -> str:
        """A random name of the browser itself."""
        return self._memory.browser

    def author(self) -> str:
        """Who decides.

        Raises:
            NameNeededError: nobody has said.
        """
        if not self.name:
            raise NameNeededError
        return self.name

    def ask(self, then: Callable[[], None] = lambda: None) -> None:
        """Ask for the name; do something under it when it has been said."""

        def named(name: str) -> None:
            self._memory.author = name
            self._show()
            self._people.rename(self._page, name)
            then()

        self._questions.ask_name(self.name or self._memory.suggested, named)

    def _show(self) -> None:
        self._shown.content = name_html(self.name)


def name_html(name: str) -> str:
    """Whose decisions are made here."""
    who = f"You decide as <b>{html.escape(name)}</b>." if name else "You are asked when you first decide."
    return boxed(f"Your name stands by every decision that you make. {who}")
