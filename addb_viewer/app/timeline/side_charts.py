"""Charts at the side on the timeline's axis, and over them a cursor that costs little to move."""

import html
import math

import numpy as np
import viser
from jaxtyping import Float

from addb_viewer.app.style.palette import VERMILION
from addb_viewer.app.timeline.chart_html import AXIS, GUTTER, HEADING, MARGIN, SMALL, axis_html, chart_html
from addb_viewer.app.timeline.charts import Chart, Line
from addb_viewer.app.timeline.span import Span

FEW = 3  # curves of which every value is written
EDGE = 0.15  # share of the axis from which the cursor's label leans inwards
ABOUT_ZERO = 0.02  # share of the largest value
CHART = 76  # [pixel] height of a plot unless told otherwise


class SideCharts:
    """Owns two pieces of the page: charts, and the cursor that lies over them."""

    def __init__(
        self, gui: viser.GuiApi, place: viser.GuiTabHandle | viser.GuiFolderHandle, chart_height: int = CHART
    ) -> None:
        self.height = chart_height
        with place:
            self._charts_html = gui.add_html("")
            self._cursor_html = gui.add_html("")
        self._times: Float[np.ndarray, " frames"] = np.zeros(1)
        self._charts: tuple[Chart, ...] = ()
        self._frame = 0
        self.span = Span(0, 1)

    def show(self, times: Float[np.ndarray, " frames"], charts: tuple[Chart, ...]) -> None:
        """Put another trial, or other charts, in place.

        Args:
            times: of the trial's frames [s].
            charts: over these frames.
        """
        self._times, self._charts = times, charts
        self._frame = min(self._frame, len(times) - 1)
        self.span = Span(0, max(len(times) - 1, 1))
        self._draw_charts()
        self._draw_cursor()

    def cursor(self, frame: int) -> None:
        """Move the cursor."""
        self._frame = frame
        self._draw_cursor()

    @property
    def pixels(self) -> int:
        """Height of the charts together."""
        return len(self._charts) * (HEADING + self.height) + (AXIS if self._charts else 0)

    def _draw_charts(self) -> None:
        if not self._charts:
            self._charts_html.content = ""
            return
        content = "".join(chart_html(chart, self.span, self.height) for chart in self._charts)
        self._charts_html.content = _clickable(content + axis_html(self.span, self._times), self.span)

    def _draw_cursor(self) -> None:
        at = 100.0 * self.span.share(self._frame)
        line = (
            f"<div data-addb-chart-cursor style='position:absolute;left:{at:.3f}%;top:0;bottom:0;width:0;"
            f"border-left:1.5px solid {VERMILION.css}'></div>"
        )
        self._cursor_html.content = (
            "<div style='position:relative;height:0;pointer-events:none;z-index:1'>"
            f"<div style='position:absolute;left:{GUTTER}px;right:{MARGIN}px;top:-{self.pixels}px;"
            f"height:{self.pixels - (AXIS if self._charts else 0)}px'>"
            f"{line}</div>{self._readouts()}</div>"
        )

    def _readouts(self) -> str:
        """The values at the cursor, at the right end of each chart's heading."""
        parts = []
        for i, chart in enumerate(self._charts):
            top = -self.pixels + i * (HEADING + self.height)
            values = " ".join(
                f"<span style='color:{line.color.as_text}'>{_shown(line.values[self._frame])}</span>"
                for line in telling(chart, self._frame)
            )
            parts.append(
                f"<div style='position:absolute;right:0;top:{top}px;height:{HEADING}px;"
                f"padding:2px {MARGIN}px 0 6px;font-size:{SMALL};line-height:1.15;font-weight:700;"
                "font-variant-numeric:tabular-nums;"
                "background:var(--mantine-color-body)'>"
                f"{values}</div>"
            )
        if self._charts:
            parts.append(self._place())
        return "".join(parts)

    def _place(self) -> str:
        """Frame and time under the cursor, kept inside."""
        share = self.span.share(self._frame)
        shift = 0 if share < EDGE else -100 if share > 1 - EDGE else -50
        return (
            f"<div style='position:absolute;left:{GUTTER}px;right:{MARGIN}px;top:-15px;font-size:{SMALL};"
            "line-height:1.15;font-weight:700;white-space:nowrap'>"
            f"<span style='position:absolute;left:{100 * share:.3f}%;transform:translateX({shift}%)'>"
            f"frame {self._frame} · {self._times[self._frame]:.3f} s</span></div>"
        )


def _clickable(content: str, span: Span) -> str:
    """A piece on which the page's script listens to clicks and drags.

    Args:
        content: safe HTML with `GUTTER` and `MARGIN` at its sides.
        span: the frames shown.
    """
    return (
        f"<div data-addb-charts data-first='{span.first}' data-last='{span.last}' "
        f"data-gutter='{GUTTER}' data-margin='{MARGIN}' style='position:relative;font-size:{SMALL};"
        f"line-height:1.15;cursor:crosshair;user-select:none;touch-action:none'>{content}</div>"
    )


def telling(chart: Chart, frame: int) -> list[Line]:
    """The curves whose value at a frame is worth its place: of many, those that are not about zero."""
    lines = [
        line
        for line in chart.lines
        if not line.dashed and frame < len(line.values) and math.isfinite(line.values[frame])
    ]
    if len(lines) <= FEW:
        return lines
    return [line for line in lines if abs(line.values[frame]) > ABOUT_ZERO * chart.largest]


def _shown(value: float) -> str:
    digits = 0 if abs(value) >= 100 else 1 if abs(value) >= 10 else 2
    return html.escape(f"{value:.{digits}f}".replace("-", "−"))
