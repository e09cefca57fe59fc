"""The control panel: which trial, where in it, what is shown, and how good the fit is."""

import html
from dataclasses import dataclass
from typing import Any

import numpy as np
import viser

from addb_viewer.app.effect_pictures import CAUSE_METRES_PER_NEWTON, LARGE_METRES_PER_NEWTON, LARGE_N
from addb_viewer.app.force_nodes import ForceSizes
from addb_viewer.app.keys import help_html
from addb_viewer.app.palette import (
    CAUSE,
    CAUSE_SURFACE,
    ERROR_FULL_SCALE,
    NO_MODEL,
    RESIDUAL,
    UNASSIGNED,
    UNSEEN,
    Rgb,
    error_colors,
    foot_color,
)
from addb_viewer.app.playback import SPEEDS
from addb_viewer.app.replay import Replay

SPEED_NAMES = {f"{speed:g}×".replace("-", "−"): speed for speed in SPEEDS}
TRAIL_LONGEST = 2.0  # [s]


@dataclass(frozen=True)
class Controls:
    """Handles of what the reviewer operates."""

    trial: viser.GuiDropdownHandle[str]
    frame: viser.GuiSliderHandle[int]
    time: viser.GuiTextHandle
    play: viser.GuiButtonHandle
    move: viser.GuiButtonGroupHandle
    speed: viser.GuiDropdownHandle[str]
    summary: viser.GuiHtmlHandle
    notes: viser.GuiHtmlHandle
    legend: viser.GuiHtmlHandle
    bones: viser.GuiCheckboxHandle
    see_through: viser.GuiCheckboxHandle
    model_markers: viser.GuiCheckboxHandle
    forces: viser.GuiCheckboxHandle
    residual: viser.GuiCheckboxHandle
    causes: viser.GuiCheckboxHandle
    trails: viser.GuiSliderHandle[float]
    follow: viser.GuiCheckboxHandle
    view: viser.GuiButtonGroupHandle


MOVES = {"|◀": "first", "◀": "back_frame", "▶": "on_frame", "▶|": "last"}  # button: action


def build_controls(gui: viser.GuiApi, trials: tuple[str, ...], views: tuple[str, ...]) -> Controls:
    """Lay out the panel; nothing is bound to anything yet."""
    trial = gui.add_dropdown("Trial", trials)
    frame = gui.add_slider("Frame", 0, 1, 1, 0)
    time = gui.add_text("Time", "", disabled=True)
    play = gui.add_button("Play", icon=viser.Icon.PLAYER_PLAY)
    move = gui.add_button_group("Move", tuple(MOVES))
    speed = gui.add_dropdown("Speed", tuple(SPEED_NAMES), initial_value="1×")
    with gui.add_folder("Fit"):
        summary = gui.add_html("")
    with gui.add_folder("Show"):
        bones = gui.add_checkbox("Bones", True)
        see_through = gui.add_checkbox("See-through", False)
        model_markers = gui.add_checkbox("Model markers", True)
        forces = gui.add_checkbox("Forces", True)
        residual = gui.add_checkbox(
            "Residual", True, hint="Force that F = ma still lacks, at the centre of mass"
        )
        causes = gui.add_checkbox("Named causes", True, hint="What the diagnosis names, where it acts")
        trails = gui.add_slider("Trails [s]", 0.0, TRAIL_LONGEST, 0.1, 0.0)
        legend = gui.add_html("")
    with gui.add_folder("Camera"):
        follow = gui.add_checkbox("Follow", True, hint="Keep the pelvis in the middle")
        view = gui.add_button_group("View", views)
    with gui.add_folder("Notes", expand_by_default=False):
        notes = gui.add_html("")
    with gui.add_folder("Keys", expand_by_default=False):
        gui.add_html(_boxed(help_html()))
    return Controls(
        trial, frame, time, play, move, speed, summary, notes, legend,
        bones, see_through, model_markers, forces, residual, causes, trails, follow, view,
    )  # fmt: skip


def speed_name(speed: float) -> str:
    """As the list has it."""
    return next(name for name, known in SPEED_NAMES.items() if known == speed)


def summary_html(figures: dict[str, Any], person: dict[str, float], replay: Replay) -> str:
    """The trial's figures, with a mark for each limit kept or passed; what was not computed is left out."""
    rows = [("Frames", f"{replay.frames} at {replay.rate:g} Hz"), *person_rows(person)]
    if not figures:
        return _boxed(_table(rows) + "<p>Not fitted yet.</p>")
    return _boxed(_table(rows + _figure_rows(figures)))


def person_rows(person: dict[str, float]) -> list[tuple[str, str]]:
    """Mass and height."""
    units = {"mass_kg": ("Mass", "{:.1f} kg"), "height_m": ("Height", "{:.2f} m")}
    return [(units[k][0], units[k][1].format(v)) for k, v in person.items() if k in units and v is not None]


def notes_html(notes: tuple[str, ...]) -> str:
    """What was assumed or ignored."""
    if not notes:
        return _boxed("Nothing was assumed or ignored.")
    items = "".join(f"<li>{html.escape(note)}</li>" for note in dict.fromkeys(notes))
    return _boxed(f"<ul style='padding-left:1.2em;margin:0;overflow-wrap:anywhere'>{items}</ul>")


def legend_html(replay: Replay, *, diagnosed: bool = False) -> str:
    """What the colours in the scene mean; those of causes once there is a diagnosis."""
    parts = []
    if replay.bodies is not None:
        ramp = error_colors(np.linspace(0.0, ERROR_FULL_SCALE, 5))
        stops = ", ".join(Rgb(*color).css for color in ramp.tolist())
        parts.append(
            f"<div style='display:flex;align-items:center;gap:.5em'>marker error 0 "
            f"<span style='flex:1;height:.7em;background:linear-gradient(to right, {stops})'></span> "
            f"≥ {100 * ERROR_FULL_SCALE:g} cm</div>"
        )
        parts.append(_swatches((("no model marker", NO_MODEL), ("lost marker", UNSEEN))))
    if replay.plates:
        feet = tuple((foot, foot_color(foot, i)) for i, foot in enumerate(replay.feet))
        parts.append(_swatches((*feet, ("no foot assigned", UNASSIGNED))))
        parts.append(f"<div>1 m of arrow is {1 / ForceSizes().metres_per_newton:.0f} N</div>")
    if replay.residual is not None:
        parts.append(_swatches((("residual force", RESIDUAL),)))
    if diagnosed:
        parts.append(_swatches((("named cause", CAUSE), ("its segment, marker or load", CAUSE_SURFACE))))
        small, large = 1 / CAUSE_METRES_PER_NEWTON, 1 / LARGE_METRES_PER_NEWTON
        of_large = f"of a step's, and above {LARGE_N:.0f} N, {large:.0f} N"
        parts.append(f"<div>1 m of its arrow is {small:.0f} N; {of_large}</div>")
    return _boxed("".join(parts))


def _figure_rows(figures: dict[str, Any]) -> list[tuple[str, str]]:
    verdicts: dict[str, bool | None] = figures.get("hicks") or {}

    def mark(key: str) -> str:
        verdict = verdicts.get(key)
        return "" if verdict is None else " ✓" if verdict else " ✗"

    rows = []
    if figures.get("marker_rms_m") is not None:
        rows.append(("Marker RMS", f"{100 * figures['marker_rms_m']:.2f} cm{mark('marker_rms')}"))
        rows.append(("Marker maximum", f"{100 * figures['marker_max_m']:.2f} cm{mark('marker_max')}"))
    if linear := figures.get("linear_residual"):
        text = f"{linear['rms_N']:.1f} N = {100 * linear['rms_BW']:.1f} % BW{mark('linear')}"
        rows.append(("Residual force", text))
    if angular := figures.get("angular_residual"):
        text = f"{angular['rms_Nm']:.1f} N·m = {100 * angular['rms_BWh']:.2f} % BW·h{mark('angular')}"
        rows.append(("Residual moment", text))
    return [*rows, ("Frames counted", f"{figures.get('frames_with_force_used', 0)} (force known)")]


def _table(rows: list[tuple[str, str]]) -> str:
    cells = "".join(
        f"<tr><td style='padding-right:.8em;opacity:.75'>{html.escape(name)}</td>"
        f"<td>{html.escape(text)}</td></tr>"
        for name, text in rows
    )
    return f"<table>{cells}</table>"


def _swatches(entries: tuple[tuple[str, Rgb], ...]) -> str:
    spans = "".join(
        f"<span style='white-space:nowrap'><span style='display:inline-block;width:.7em;height:.7em;"
        f"background:{color.css}'></span> {html.escape(name)}</span> "
        for name, color in entries
    )
    return f"<div style='display:flex;flex-wrap:wrap;gap:.1em .8em'>{spans}</div>"


def _boxed(content: str) -> str:
    return f"<div style='font-size:.8rem;line-height:1.45;padding:.2em .6em'>{content}</div>"
