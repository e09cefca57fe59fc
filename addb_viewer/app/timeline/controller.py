"""The timeline of one browser: the strip at the lower edge, and what is chosen on it."""

from collections.abc import Callable

from addb_viewer.app.page.screen import Screen
from addb_viewer.trial_view.charts import charts_of
from addb_viewer.trial_view.lanes import Lane
from addb_viewer.trial_view.replay import Replay
from addb_viewer.trial_view.strip import ON_STRIP, curves_json, rows_json, trial_json


class TimelineController:
    """What one reviewer sees over time."""

    def __init__(self, screen: Screen, compared: Callable[[], Replay | None]) -> None:
        """Show nothing yet.

        Args:
            screen: of the browser.
            compared: the trial as the solve that is compared with has it; None: nothing is compared.
        """
        self.screen, self.channel, self._compared = screen, screen.channel, compared

    def show(self) -> None:
        """Draw the trial that is on the screen."""
        replay = self.screen.replay
        if replay is None:
            return
        charts = charts_of(replay, self._compared())
        self.channel.show("trial", trial_json(self.screen.shared.name, replay))
        self.screen.draw_lanes()
        self.channel.show("curves", curves_json([c for c in charts if c.title in ON_STRIP]))

    def draw_lanes(self, lanes: tuple[Lane, ...], chosen: tuple[int, int] | None) -> None:
        """Draw what people and detection say.

        Args:
            lanes: of the trial on the screen.
            chosen: the selected range.
        """
        self.channel.show("rows", rows_json(lanes))
        self.select(chosen)

    def cursor(self, frame: int) -> None:
        """Move the cursor."""
        self.channel.show("cursor", frame)

    def select(self, frames: tuple[int, int] | None) -> None:
        """Show which range keys act on."""
        self.channel.show("selection", frames)
