"""The tab of curves of one browser: what is chosen there, and what the page draws of it."""

from collections.abc import Callable
from typing import Any

import viser

from addb_viewer.app.curves.over_time import AT_FIRST, charts_json, choices_json
from addb_viewer.app.page.reviewer import BrowserMemory
from addb_viewer.app.page.screen import Screen
from addb_viewer.app.trial.replay import Replay

PLACE = "<div data-addb-curves></div>"  # where the page's script puts its charts
MOST_CHOSEN, LONGEST = 60, 200  # charts at once; letters of a name


class CurvesController:
    """What one reviewer sees as curves."""

    def __init__(
        self,
        gui: viser.GuiApi,
        tab: viser.GuiTabHandle,
        screen: Screen,
        memory: BrowserMemory,
        compared: Callable[[], Replay | None],
    ) -> None:
        """Lay out the tab.

        Args:
            gui: of the browser.
            tab: where.
            screen: of the browser.
            memory: what the browser remembers.
            compared: the trial as the solve that is compared with has it; None: nothing is compared.
        """
        self.screen, self.channel, self._memory, self._compared = screen, screen.channel, memory, compared
        with tab:
            self._place = gui.add_html("")
        self.channel.on("curves", self._asked)

    @property
    def chosen(self) -> tuple[str, ...]:
        """Ids of what is shown, in order; of a browser that never chose, the usual ones."""
        kept = self._memory.curves.get("chosen")
        return AT_FIRST if kept is None else tuple(names_in(kept))

    def show(self) -> None:
        """Draw the charts of the trial that is on the screen."""
        replay = self.screen.replay
        if replay is None:
            return
        self._place.content = PLACE
        choices = choices_json(replay)
        self.channel.show("curve-choices", {"choices": choices, "chosen": list(self.chosen)})
        self.channel.show("curve-charts", {"charts": charts_json(replay, self._compared(), (), self.chosen)})

    def _asked(self, wish: Any) -> None:
        """The page wants something else to be shown."""
        match wish:
            case {"chosen": list(chosen)}:
                kept = {"chosen": list(names_in(chosen))}
                self.screen.notices.do("Charting", lambda: self._choose(kept))

    def _choose(self, wish: dict[str, Any]) -> None:
        self._memory.curves = wish
        self.show()


def names_in(said: object) -> list[str]:
    """The names in what a browser says or remembers; whatever else it says is dropped."""
    names = said if isinstance(said, list) else []
    return [name for name in names if isinstance(name, str) and len(name) <= LONGEST][:MOST_CHOSEN]
