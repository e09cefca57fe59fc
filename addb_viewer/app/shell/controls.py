"""The controls on the left: which trial, where in it, the banner, and tabs; and how wide all panels are."""

from dataclasses import dataclass

import viser

from addb_viewer.app.scene.legend import TINTS
from addb_viewer.app.shell.fit_tab import FitTab
from addb_viewer.app.shell.playback import SPEEDS

SPEED_NAMES = {f"{speed:g}×".replace("-", "−"): speed for speed in SPEEDS}
TRAIL_LONGEST = 2.0  # [s]
MOVES = {"|◀": "first", "◀": "back_frame", "▶": "on_frame", "▶|": "last"}  # button: action
SAVE = ("PNG", "Film")
CONTROLS, CONTROLS_WIDTH = 0.3, 320  # the controls' share of a narrow window; [pixel] at most
NARROWEST, WIDEST = 372, 660  # [pixel] of the timeline
OF_WINDOW = 0.34  # the timeline's share of it


@dataclass(frozen=True)
class Show:
    """What the scene shows."""

    bones: viser.GuiCheckboxHandle
    tint: viser.GuiDropdownHandle[str]
    see_through: viser.GuiCheckboxHandle
    model_markers: viser.GuiCheckboxHandle
    forces: viser.GuiCheckboxHandle
    required: viser.GuiCheckboxHandle
    residual: viser.GuiCheckboxHandle
    total: viser.GuiCheckboxHandle
    causes: viser.GuiCheckboxHandle
    trails: viser.GuiSliderHandle[float]
    legend: viser.GuiHtmlHandle
    follow: viser.GuiCheckboxHandle
    view: viser.GuiButtonGroupHandle
    measure: viser.GuiCheckboxHandle
    measured: viser.GuiHtmlHandle
    save: viser.GuiButtonGroupHandle
    dark: viser.GuiCheckboxHandle

    @property
    def switches(self) -> tuple[viser.GuiInputHandle, ...]:
        """Those that change the picture."""
        return (
            self.bones,
            self.tint,
            self.see_through,
            self.model_markers,
            self.forces,
            self.required,
            self.residual,
            self.total,
            self.causes,
            self.trails,
        )


@dataclass(frozen=True)
class Tabs:
    """Where the panels lay out what is theirs."""

    review: viser.GuiTabHandle
    queue: viser.GuiTabHandle
    solve: viser.GuiTabHandle
    view: viser.GuiTabHandle


@dataclass(frozen=True)
class Controls:
    """Handles of what the reviewer operates."""

    trial: viser.GuiDropdownHandle[str]
    frame: viser.GuiSliderHandle[int]
    go_to: viser.GuiTextHandle
    play: viser.GuiButtonHandle
    move: viser.GuiButtonGroupHandle
    speed: viser.GuiDropdownHandle[str]
    fit: FitTab
    show: Show
    tabs: Tabs


def build_controls(gui: viser.GuiApi, views: tuple[str, ...], *, dark: bool) -> Controls:
    """Lay out the panel; nothing is bound to anything yet.

    Args:
        gui: of the browser.
        views: names of the camera's views.
        dark: the present theme.
    """
    trial = gui.add_dropdown("Trial", ("–",))
    frame = gui.add_slider("Frame", 0, 1, 1, 0)
    go_to = gui.add_text("Go to", "", hint="A frame, as 57, or frames to select, as 120-179")
    play = gui.add_button("Play", icon=viser.Icon.PLAYER_PLAY, hint="Key Space")
    move = gui.add_button_group("Move", tuple(MOVES))
    speed = gui.add_dropdown("Speed", tuple(SPEED_NAMES), initial_value="1×")
    tabs = gui.add_tab_group()
    review, queue = tabs.add_tab("Review"), tabs.add_tab("Queue")
    solve = tabs.add_tab("Solve")
    view = tabs.add_tab("View")
    with view:
        show = _show(gui, views, dark)
    fit = FitTab(gui, tabs.add_tab("Fit"))
    return Controls(
        trial,
        frame,
        go_to,
        play,
        move,
        speed,
        fit,
        show,
        Tabs(review, queue, solve, view),
    )


def _show(gui: viser.GuiApi, views: tuple[str, ...], dark: bool) -> Show:
    view = gui.add_button_group("View", views)
    measure = gui.add_checkbox("Measure", False, hint="Distances and angles by clicks in the scene; key D")
    measured = gui.add_html("")
    save = gui.add_button_group("Save", SAVE, hint="A picture of the scene, or the selected frames")
    follow = gui.add_checkbox("Follow", True, hint="Keep the pelvis in the middle")
    bones = gui.add_checkbox("Bones", True)
    tint = gui.add_dropdown("Bones show", TINTS, hint="What their colour says; the legend has the scale")
    see_through = gui.add_checkbox("See-through", False)
    model_markers = gui.add_checkbox("Model markers", True)
    forces = gui.add_checkbox("Forces", True)
    required = gui.add_checkbox(
        "Missing forces", True, hint="What the motion demands of a foot whose force is missing, hollow"
    )
    residual = gui.add_checkbox("Residual", True, hint="Force that F = ma still lacks, at the centre of mass")
    total = gui.add_checkbox(
        "Total force", True, hint="At the centre of mass: measured, and hollow, required by the motion"
    )
    causes = gui.add_checkbox("Named causes", True, hint="What the diagnosis names, where it acts")
    trails = gui.add_slider("Trails [s]", 0.0, TRAIL_LONGEST, 0.1, 0.0)
    dark_theme = gui.add_checkbox("Dark", dark, hint="Dark theme")
    legend = gui.add_html("")
    return Show(
        bones, tint, see_through, model_markers, forces, required, residual, total, causes, trails, legend,
        follow, view, measure, measured, save, dark_theme,
    )  # fmt: skip


def speed_name(speed: float) -> str:
    """As the list has it."""
    return next(name for name, known in SPEED_NAMES.items() if known == speed)


@dataclass(frozen=True)
class Layout:
    """Sizes [pixel]."""

    controls_width: int
    timeline_width: int


def layout_for(client: viser.ClientHandle) -> Layout:
    """The layout for a window that has no panels yet."""
    return layout_of(client.camera.image_width)


def layout_of(width: int) -> Layout:
    """The layout for a window so many pixels wide."""
    timeline = round(min(max(OF_WINDOW * width, NARROWEST), WIDEST))
    return Layout(min(round(CONTROLS * width), CONTROLS_WIDTH), timeline)
