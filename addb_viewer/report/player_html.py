"""The player's place on the page; player.js fills it."""

from collections.abc import Sequence

from addb_viewer.report.markup import Safe, element

SPEEDS = ("0.1", "0.25", "0.5", "1", "2")


def player_html(trials: Sequence[str], frame: int) -> Safe:
    """Picture, bar and buttons.

    Args:
        trials: their names.
        frame: of the first one, that is shown first.
    """
    choices = [element("option", name, value=str(i)) for i, name in enumerate(trials)]
    speeds = [Safe(f'<option value="{s}"{" selected" if s == "1" else ""}>{s} ×</option>') for s in SPEEDS]
    hidden = {} if len(trials) > 1 else {"hidden": "hidden"}
    picture = element(
        "div",
        Safe(
            '<canvas data-role="canvas" tabindex="0" role="img" aria-label="Playable 3-D scene; arrow keys '
            'go from frame to frame, space plays"></canvas>'
        ),
        element("div", "", class_="status", data_role="status", aria_live="off"),
        element("p", "Loading the scene …", class_="message", data_role="message"),
        class_="picture",
    )
    bar = element(
        "div",
        Safe('<div class="marks" data-role="marks"></div>'),
        Safe('<input type="range" data-role="bar" min="0" value="0" step="1" aria-label="Frame">'),
        class_="scrub",
    )
    controls = element(
        "div",
        element("button", "▶ Play", type="button", data_role="play"),
        element("output", "", data_role="where"),
        element("label", "Speed ", element("select", *speeds, data_role="speed")),
        element("label", "Trial ", element("select", *choices, data_role="trial"), **hidden),
        element("label", Safe('<input type="checkbox" data-role="follow" checked>'), " follow"),
        element("button", "Reset view", type="button", data_role="home"),
        class_="controls",
    )
    return element("div", picture, bar, controls, id="player", data_frame=str(frame))
