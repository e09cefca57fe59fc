"""The timeline of one browser: its lanes, its charts, and what is chosen for it."""

from collections.abc import Callable

import viser

from addb_viewer.app.page.screen import Screen
from addb_viewer.app.timeline.charts import charts_of, joint_choices
from addb_viewer.app.timeline.lanes import Lane
from addb_viewer.app.timeline.timeline import Timeline
from addb_viewer.app.trial.replay import Replay

JOINTS = 2  # that can be charted at once
PAGES_S = {"all": None, "10 s": 10.0, "4 s": 4.0, "2 s": 2.0, "1 s": 1.0}  # how much is shown
NO_JOINT = "–"


class TimelineController:
    """What one reviewer sees over time."""

    def __init__(
        self,
        gui: viser.GuiApi,
        tab: viser.GuiTabHandle,
        screen: Screen,
        chart_height: int,
        compared: Callable[[], Replay | None],
    ) -> None:
        """Lay out the tab.

        Args:
            gui: of the browser.
            tab: where.
            screen: of the browser.
            chart_height: [pixel].
            compared: the trial as the solve that is compared with has it; None: nothing is compared.
        """
        self.screen, self._compared = screen, compared
        self.drawn = Timeline(gui, tab, chart_height)
        with tab:
            self.page = gui.add_dropdown(
                "Shown", tuple(PAGES_S), hint="How much of the trial is seen at once"
            )
            self.joints = tuple(gui.add_dropdown(f"Joint {i + 1}", (NO_JOINT,)) for i in range(JOINTS))
        for handle in self.joints:
            handle.on_update(screen.notices.in_order("Charting", self.show))
        self.page.on_update(screen.notices.in_order("Zooming", self._zoom))

    def show(self) -> None:
        """Draw the charts of the trial that is on the screen."""
        replay = self.screen.replay
        if replay is None:
            return
        names = () if replay.joints is None else tuple(joint_choices(replay.joints))
        for handle in self.joints:
            if handle.options != (NO_JOINT, *names):
                handle.options = (NO_JOINT, *names)
        chosen = tuple(str(handle.value) for handle in self.joints)
        self.screen.draw_lanes()
        self.drawn.show(replay.times, charts_of(replay, self._compared(), chosen))
        self._zoom()

    def draw_lanes(self, lanes: tuple[Lane, ...], chosen: tuple[int, int] | None) -> None:
        """Draw what people and detection say.

        Args:
            lanes: of the trial on the screen.
            chosen: the selected range.
        """
        self.drawn.lanes(lanes)
        self.drawn.select(chosen)

    def cursor(self, frame: int) -> None:
        """Move the cursor."""
        self.drawn.cursor(frame)

    def select(self, frames: tuple[int, int] | None) -> None:
        """Show which range keys act on."""
        self.drawn.select(frames)

    def _zoom(self) -> None:
        replay, seconds = self.screen.replay, PAGES_S[str(self.page.value)]
        if replay is not None:
            self.drawn.zoom(None if seconds is None else max(round(seconds * replay.rate), 2))
