"""The timeline of one browser: the strip at the lower edge, the charts at the side, and what is chosen."""

from collections.abc import Callable
from typing import Any

import viser

from addb_viewer.app.page.handles import put
from addb_viewer.app.page.screen import Screen
from addb_viewer.app.timeline.charts import charts_of, joint_choices
from addb_viewer.app.timeline.lanes import Lane
from addb_viewer.app.timeline.side_charts import SideCharts
from addb_viewer.app.timeline.span import Span
from addb_viewer.app.timeline.strip import curves_json, rows_json, trial_json
from addb_viewer.app.trial.replay import Replay

JOINTS = 4  # that can be charted at once
AT_FIRST = ("knee_angle_r angle", "knee_angle_l angle", "knee_angle_r torque", "knee_angle_l torque")
NO_JOINT = "–"
ON_STRIP = ("Residual force", "Residual moment")  # charts that the strip has


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
        self.screen, self.channel, self._compared = screen, screen.channel, compared
        self.drawn = SideCharts(gui, tab, chart_height)
        with tab:
            self.joints = tuple(gui.add_dropdown(f"Joint {i + 1}", (NO_JOINT,)) for i in range(JOINTS))
        for handle in self.joints:
            handle.on_update(screen.notices.in_order("Charting", self.show))
        self._chosen = False  # whether joints were charted once
        self.channel.on("span", self._zoomed)

    def show(self) -> None:
        """Draw the charts of the trial that is on the screen."""
        replay = self.screen.replay
        if replay is None:
            return
        names = () if replay.joints is None else tuple(joint_choices(replay.joints))
        for handle in self.joints:
            if handle.options != (NO_JOINT, *names):
                handle.options = (NO_JOINT, *names)
            handle.visible = bool(names)
        self._choose_at_first(names)
        chosen = tuple(str(handle.value) for handle in self.joints)
        charts = charts_of(replay, self._compared(), chosen)
        self.channel.show("trial", trial_json(self.screen.shared.name, replay))
        self.screen.draw_lanes()
        self.channel.show("curves", curves_json([c for c in charts if c.title in ON_STRIP]))
        self.drawn.show(replay.times, tuple(c for c in charts if c.title not in ON_STRIP))

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
        self.drawn.cursor(frame)

    def select(self, frames: tuple[int, int] | None) -> None:
        """Show which range keys act on."""
        self.channel.show("selection", frames)
        self.drawn.select(frames)

    def _choose_at_first(self, names: tuple[str, ...]) -> None:
        """Where a fit is seen for the first time, some joints, for whom nothing was chosen."""
        if self._chosen or not names:
            return
        self._chosen = True
        for handle, name in zip(self.joints, AT_FIRST, strict=True):
            if name in names and handle.value == NO_JOINT:
                put(handle, name)

    def _zoomed(self, span: Any) -> None:
        """The strip shows other frames: so do the charts."""
        match span:
            case [int(first), int(last)] if 0 <= first < last:
                self.screen.notices.do("Zooming", lambda: self._zoom(first, last))

    def _zoom(self, first: int, last: int) -> None:
        replay = self.screen.replay
        if replay is not None and last < replay.frames:
            self.drawn.zoom(Span(first, last))
