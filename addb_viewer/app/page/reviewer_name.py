"""Who decides at one browser: asked before the first decision, remembered there, changed at any time."""

from collections.abc import Callable

import viser

from addb_viewer.app.page.browser_memory import Remembered
from addb_viewer.app.page.questions import Questions
from addb_viewer.app.review.html import name_html
from addb_viewer.app.subjects.people import NameNeededError, People


class Naming:
    """The name of the person at one page."""

    def __init__(
        self, memory: Remembered, questions: Questions, people: People, page: int, shown: viser.GuiHtmlHandle
    ) -> None:
        self._memory, self._questions, self._people = memory, questions, people
        self._page, self._shown = page, shown
        self._show()

    @property
    def name(self) -> str:
        """Empty where nobody has said."""
        return self._memory.author

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
