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
    """What one browser remembers; `keep` after a change."""

    def __init__(self, channel: Channel, suggested: str) -> None:
        """Ask the browser.

        Args:
            channel: to the page, which keeps it.
            suggested: name for who has not said one yet.
        """
        self._channel, self.suggested = channel, suggested
        greeting = channel.greeting()
        kept = greeting.memory
        self.author = str(kept.get("reviewer") or "")  # who decides here; empty where nobody has said
        # A random name of the browser itself: two of its pages have the same one.
        self.browser = str(kept.get("browser") or "") or secrets.token_hex(8)
        self.system_dark = greeting.dark  # its system wishes dark pages
        theme = kept.get("theme")
        self._theme = theme if theme in ("dark", "light") else None  # chosen against the system's wish
        self.place: tuple[str, str] | None = None  # subject and trial that were on the screen last
        match kept.get("place"):
            case [str(subject), str(trial)]:
                self.place = (subject, trial)
        curves = kept.get("curves")  # what was chosen in the tab of curves, as the browser gave it
        self.curves: dict[str, Any] = curves if isinstance(curves, dict) else {}
        self.keep()

    @property
    def dark(self) -> bool:
        """As chosen here; else as the system wishes."""
        return self.system_dark if self._theme is None else self._theme == "dark"

    def choose_theme(self, dark: bool) -> None:
        """Keep a choice against the system's wish; one that agrees with it follows it again."""
        self._theme = None if dark == self.system_dark else "dark" if dark else "light"
        self.keep()

    def keep(self) -> None:
        """Let the browser remember what is known now."""
        kept = {"reviewer": self.author, "browser": self.browser, "theme": self._theme}
        self._channel.show("memory", kept | {"place": self.place, "curves": self.curves})


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
            self._memory.keep()
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
