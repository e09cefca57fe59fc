"""How wide panels and how high charts are, by the size of the browser's window."""

from dataclasses import dataclass

import viser

CONTROLS = 320  # [pixel]
NARROWEST, WIDEST = 400, 660  # [pixel] of the timeline
OF_WINDOW = 0.34  # the timeline's share of it
CHARTS, ABOVE, BELOW = 5, 190, 170  # usual charts; [pixel] of tabs and lanes above, of choosers below
LOWEST, HIGHEST = 62, 150  # [pixel] of a chart


@dataclass(frozen=True)
class Layout:
    """Sizes [pixel]."""

    controls_width: int
    timeline_width: int
    chart_height: int


def fitted(client: viser.ClientHandle) -> Layout:
    """The layout for a window that has no panels yet."""
    return sizes(client.camera.image_width, client.camera.image_height)


def sizes(width: int, height: int) -> Layout:
    """The layout for a window of so many pixels."""
    timeline = round(min(max(OF_WINDOW * width, NARROWEST), WIDEST))
    chart = round((height - ABOVE - BELOW) / CHARTS) - 17
    return Layout(CONTROLS, timeline, min(max(chart, LOWEST), HIGHEST))
