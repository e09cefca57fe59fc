"""What the colours in the scene mean, as a piece of the page."""

import html

import numpy as np
from jaxtyping import Float, UInt8

from addb_viewer.app.scene.force_nodes import METRES_PER_NEWTON
from addb_viewer.trial_view.cause_pictures import CAUSE_METRES_PER_NEWTON, LARGE_METRES_PER_NEWTON, LARGE_N
from addb_viewer.trial_view.html_pieces import boxed
from addb_viewer.trial_view.palette import (
    CAUSE,
    CAUSE_SURFACE,
    ERROR_FULL_SCALE,
    LOAD_STEPS,
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

BY_NOTHING, BY_TORQUE, BY_RESIDUAL = TINTS = ("one colour", "joint torque", "residual")
OVER = 2.0  # times its limit: a residual that has the last colour


def tints(replay: Replay, kind: str) -> UInt8[np.ndarray, "frames bodies 3"] | None:
    """Of every body; None where nothing is known, or asked for.

    Args:
        replay: the trial.
        kind: one of `TINTS`.
    """
    share = _share(replay, kind)
    return None if share is None else load_colors(np.rint(share * LOAD_STEPS) / LOAD_STEPS)


def tint_words(replay: Replay, kind: str) -> tuple[str, str, str] | None:
    """What the colours stand for: their quantity, and what the first and the last one mean."""
    if _share(replay, kind) is None:
        return None
    if kind == BY_TORQUE and replay.joint_loads is not None:
        return "joint torque, on the bone beyond the joint", "0", f"≥ {replay.joint_loads.large:.0f} N·m"
    assert replay.residual is not None
    return "residual force", "0", f"≥ {OVER * replay.residual.force_limit:.0f} N, {OVER:g} times its limit"


def _share(replay: Replay, kind: str) -> Float[np.ndarray, "frames bodies"] | None:
    """Of what has the last colour [0 to 1]; NaN where it is not known."""
    if replay.bodies is None:
        return None
    if kind == BY_TORQUE and replay.joint_loads is not None and replay.joint_loads.large > 0:
        return np.minimum(replay.joint_loads.of_bodies / replay.joint_loads.large, 1.0)
    if kind == BY_RESIDUAL and replay.residual is not None:
        size = np.linalg.norm(replay.residual.force, axis=1) / (OVER * replay.residual.force_limit)
        return np.repeat(np.minimum(size, 1.0)[:, None], len(replay.bodies.names), axis=1)
    return None


def legend_html(replay: Replay, *, diagnosed: bool = False, tint: str = BY_NOTHING) -> str:
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
    elif tint != BY_NOTHING:
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
        parts.append(f"<div>1 m of arrow is {1 / METRES_PER_NEWTON:.0f} N</div>")
    elif replay.required:
        parts.append(
            "<div>hollow arrow: force on a foot, predicted from the motion; nothing was measured</div>"
            f"<div>1 m of arrow is {1 / METRES_PER_NEWTON:.0f} N</div>"
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
        f"<span style='flex:1;height:.7em;background:linear-gradient(to right, {stops})'></span> {high}</div>"
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
