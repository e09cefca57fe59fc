"""What the colours in the scene mean, as a piece of the page."""

import html

import numpy as np
from jaxtyping import UInt8

from addb_viewer.app.scene.force_nodes import ForceSizes
from addb_viewer.app.scene.tints import NONE, tint_words
from addb_viewer.trial_view.cause_pictures import CAUSE_METRES_PER_NEWTON, LARGE_METRES_PER_NEWTON, LARGE_N
from addb_viewer.trial_view.html_pieces import boxed
from addb_viewer.trial_view.palette import (
    CAUSE,
    CAUSE_SURFACE,
    ERROR_FULL_SCALE,
    NO_MODEL,
    RESIDUAL,
    TOTAL,
    UNASSIGNED,
    UNSEEN,
    Rgb,
    error_colors,
    foot_color,
    load_colors,
)
from addb_viewer.trial_view.replay import Replay
from annotations.foot_names import foot_words


def legend_html(replay: Replay, *, diagnosed: bool = False, tint: str = NONE) -> str:
    """What the colours in the scene mean; those of causes once there is a diagnosis.

    Args:
        replay: the trial.
        diagnosed: whether there is one.
        tint: what the bones' colour says.
    """
    parts = []
    if words := tint_words(replay, tint):
        what, low, high = words
        parts.append(f"<div>{what}:</div>" + _ramp_html(low, load_colors(np.linspace(0.0, 1.0, 7)), high))
    elif tint != NONE:
        parts.append(f"<div>Bones have one colour: no {tint} is known in this trial.</div>")
    if replay.bodies is not None:
        ramp = error_colors(np.linspace(0.0, ERROR_FULL_SCALE, 5))
        parts.append(_ramp_html("marker error 0", ramp, f"≥ {100 * ERROR_FULL_SCALE:g} cm"))
        parts.append(_swatches((("no model marker", NO_MODEL), ("lost marker", UNSEEN))))
    if replay.plates:
        feet = tuple((_foot(foot), foot_color(foot, i)) for i, foot in enumerate(replay.feet))
        parts.append(_swatches((*feet, ("no foot assigned", UNASSIGNED))))
        if replay.feet and any(plate.corners is not None for plate in replay.plates):
            parts.append(
                "<div>plates: in the colour of the foot that they serve; grey: of none, or both</div>"
            )
        if replay.required:
            parts.append(
                "<div>hollow arrow: force that the motion requires where a foot's force is missing</div>"
            )
        parts.append(f"<div>1 m of arrow is {1 / ForceSizes().metres_per_newton:.0f} N</div>")
    elif replay.required:
        parts.append(
            "<div>hollow arrow: force on a foot, predicted from the motion; nothing was measured</div>"
            f"<div>1 m of arrow is {1 / ForceSizes().metres_per_newton:.0f} N</div>"
        )
    if replay.residual is not None:
        parts.append(_swatches((("residual force", RESIDUAL), ("total force at the centre of mass", TOTAL))))
    if diagnosed:
        parts.append(_swatches((("named cause", CAUSE), ("its segment, marker or load", CAUSE_SURFACE))))
        small, large = 1 / CAUSE_METRES_PER_NEWTON, 1 / LARGE_METRES_PER_NEWTON
        of_large = f"of a step's, and above {LARGE_N:.0f} N, {large:.0f} N"
        parts.append(f"<div>1 m of its arrow is {small:.0f} N; {of_large}</div>")
    return boxed("".join(parts))


def _ramp_html(low: str, colors: UInt8[np.ndarray, "stops 3"], high: str) -> str:
    stops = ", ".join(Rgb(*color).css for color in colors.tolist())
    return (
        f"<div style='display:flex;align-items:center;gap:.5em'>{low} "
        f"<span style='flex:1;height:.7em;background:linear-gradient(to right, {stops})'></span> "
        f"{high}</div>"
    )


def _foot(body: str) -> str:
    words = foot_words(body)
    return body if words == body else f"{words} foot"


def _swatches(entries: tuple[tuple[str, Rgb], ...]) -> str:
    spans = "".join(
        f"<span style='white-space:nowrap'><span style='display:inline-block;width:.7em;height:.7em;"
        f"background:{color.css}'></span> {html.escape(name)}</span> "
        for name, color in entries
    )
    return f"<div style='display:flex;flex-wrap:wrap;gap:.1em .8em'>{spans}</div>"
