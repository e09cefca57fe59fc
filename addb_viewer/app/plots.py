"""The plot panel: one chart below the other on a common time axis, with a cursor at the present frame."""

import html

import viser
from viser import uplot

from addb_viewer.app.charts import Chart, Points, thinned
from addb_viewer.app.palette import GREY, VERMILION
from addb_viewer.app.replay import Replay

CHART_HEIGHT = 132  # [pixel] four of them fit below one another on a laptop
AXIS_WIDTH = 52  # [pixel] the same for all, so that times lie below one another
OWN_SCALE = "share"  # of cursor and shading: 0 to 1 whatever the curves do


class PlotPanel:
    """Owns the charts inside one tab or folder."""

    def __init__(self, gui: viser.GuiApi, place: viser.GuiTabHandle | viser.GuiFolderHandle) -> None:
        self.gui, self.place = gui, place
        self.plots: list[tuple[viser.GuiUplotHandle, Points]] = []
        self.texts: list[viser.GuiHtmlHandle] = []
        self.time = float("nan")

    def show(self, replay: Replay, charts: tuple[Chart, ...]) -> None:
        """Put another trial's charts in place."""
        for handle in (*self.texts, *(plot for plot, _ in self.plots)):
            handle.remove()
        self.texts, self.plots = [], []
        self.time = float(replay.times[0])
        with self.place:
            for chart in charts:
                self.texts.append(self.gui.add_html(heading_html(chart)))
                self.plots.append(self._added(chart, replay))
            self.texts.append(self.gui.add_html(footer_html(charts)))

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
            scales={
                "x": uplot.Scale(time=False, range=(float(replay.times[0]), float(replay.times[-1]))),
                "y": uplot.Scale(range=value_range(points)),
                OWN_SCALE: uplot.Scale(auto=False, range=(0.02, 1.0)),
            },
            axes=(uplot.Axis(size=24), uplot.Axis(size=AXIS_WIDTH, scale="y", space=24)),
            legend=uplot.Legend(show=False),
            cursor=uplot.Cursor(drag={"x": True, "y": False, "setScale": True}),
            height=CHART_HEIGHT,
            padding=(10, 12, 0, 0),
        )
        return plot, points


def value_range(points: Points) -> tuple[float, float]:
    """Axis limits around all curves and zero, with a little air."""
    lowest = min(0.0, *(float(curve.min()) for curve in points.curves))
    highest = max(0.0, *(float(curve.max()) for curve in points.curves))
    air = 0.06 * (highest - lowest) or 1.0
    return (lowest - air if lowest < 0 else 0.0, highest + air)


def heading_html(chart: Chart) -> str:
    """Title, unit, and which colour is which curve."""
    keys = " ".join(
        f"<span style='white-space:nowrap'><span style='color:{line.color.css};font-weight:bold'>"
        f"{'┅' if line.dashed else '━'}</span> {html.escape(line.label)}</span>"
        for line in chart.lines
    )
    return (
        "<div style='display:flex;flex-wrap:wrap;gap:0 .7em;font-size:.75rem;padding:0 .6em'>"
        f"<b>{html.escape(chart.heading)}</b>{keys}</div>"
    )


def footer_html(charts: tuple[Chart, ...]) -> str:
    """What all charts share."""
    text = "Nothing to plot: no forces and no fit."
    if charts:
        text = "Over time [s]. Grey: not measured or not counted. Drag to zoom, double-click to see all."
    return f"<p style='font-size:.75rem;opacity:.75;padding:0 .8em;margin:.3em 0'>{text}</p>"


def _series(chart: Chart) -> tuple[uplot.Series, ...]:
    bare = uplot.Series_Points(show=False)
    curves = [
        uplot.Series(
            label=line.label, stroke=line.color.css, width=1.0 if line.dashed else 1.5, scale="y",
            dash=(5.0, 4.0) if line.dashed else (), points=bare,
        )
        for line in chart.lines
    ]  # fmt: skip
    shading = uplot.Series(scale=OWN_SCALE, stroke=GREY.faded(0.0), fill=GREY.faded(0.25), points=bare)
    spike = uplot.Series(scale=OWN_SCALE, stroke=VERMILION.css, width=1.0, points=bare)
    return (uplot.Series(), *curves, shading, spike)
