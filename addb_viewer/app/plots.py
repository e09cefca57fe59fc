"""The plot panel: one chart below the other on a common time axis, with a cursor at the present frame."""

import viser
from viser import uplot

from addb_viewer.app.charts import Chart, Points, thinned
from addb_viewer.app.palette import GREY, VERMILION
from addb_viewer.app.replay import Replay

CHART_HEIGHT = 150  # [pixel] four of them fit below one another on a laptop
AXIS_WIDTH = 44  # [pixel] the same for all, so that times lie below one another
OWN_SCALE = "share"  # of cursor and shading: 0 to 1 whatever the curves do


class PlotPanel:
    """Owns the charts inside one tab."""

    def __init__(self, gui: viser.GuiApi, tab: viser.GuiTabHandle) -> None:
        self.gui, self.tab = gui, tab
        self.plots: list[tuple[viser.GuiUplotHandle, Points]] = []
        self.time = float("nan")
        self.empty: viser.GuiHtmlHandle | None = None

    def show(self, replay: Replay, charts: tuple[Chart, ...]) -> None:
        """Put another trial's charts in place."""
        for plot, _ in self.plots:
            plot.remove()
        if self.empty is not None:
            self.empty.remove()
            self.empty = None
        self.time = float(replay.times[0])
        with self.tab:
            if not charts:
                self.empty = self.gui.add_html("<p style='padding:0 1em'>Nothing to plot: no forces, no fit.</p>")
            self.plots = [self._added(chart, replay) for chart in charts]

    def cursor(self, time: float) -> None:
        """Move the cursor to a time [s]."""
        if time == self.time:
            return
        self.time = time
        for plot, points in self.plots:
            plot.data = points.with_cursor(time)

    def _added(self, chart: Chart, replay: Replay) -> tuple[viser.GuiUplotHandle, Points]:
        points = thinned(chart, replay.times)
        plot = self.gui.add_uplot(
            points.with_cursor(self.time),
            _series(chart),
            title=chart.heading,
            scales={
                "x": uplot.Scale(time=False, range=(float(replay.times[0]), float(replay.times[-1]))),
                "y": uplot.Scale(auto=True),
                OWN_SCALE: uplot.Scale(auto=False, range=(0.001, 1.0)),
            },
            axes=(uplot.Axis(size=26, label=None), uplot.Axis(size=AXIS_WIDTH, scale="y")),
            legend=uplot.Legend(show=True, live=False),
            cursor=uplot.Cursor(drag={"x": True, "y": False, "setScale": True}),
            height=CHART_HEIGHT,
            padding=(0, 12, 0, 0),
        )
        return plot, points


def _series(chart: Chart) -> tuple[uplot.Series, ...]:
    curves = [
        uplot.Series(
            label=line.label, stroke=line.color.css, width=1.0 if line.dashed else 1.5, scale="y",
            dash=(5.0, 4.0) if line.dashed else (), points={"show": False},
        )
        for line in chart.lines
    ]  # fmt: skip
    shading = uplot.Series(
        label="not counted", scale=OWN_SCALE, stroke=GREY.faded(0.0), fill=GREY.faded(0.25), points={"show": False}
    )
    spike = uplot.Series(label="now", scale=OWN_SCALE, stroke=VERMILION.css, width=1.0, points={"show": False})
    return (uplot.Series(label="time [s]"), *curves, shading, spike)


