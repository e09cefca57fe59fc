"""The controls on the left: tabs in which panels lay out what is theirs; and how wide all panels are."""

from dataclasses import dataclass
from typing import Any

import viser

from addb_viewer.app.scene.legend import TINTS
from addb_viewer.app.shell.fit_tab import FitTab

TRAIL_LONGEST = 2.0  # [s]
SAVE = {"PNG": "picture", "Film": "film"}  # button: action
CONTROLS, CONTROLS_WIDTH = 0.3, 320  # the controls' share of a narrow window; [pixel] at most
NARROWEST, WIDEST = 372, 660  # [pixel] of the timeline
OF_WINDOW = 0.34  # the timeline's share of it


class Show:
    """What the scene shows."""

    def __init__(self, gui: viser.GuiApi, views: tuple[str, ...], *, dark: bool) -> None:
        self.view = gui.add_button_group("View", views)
        self.measure = gui.add_checkbox(
            "Measure", False, hint="Distances and angles by clicks in the scene; key D"
        )
        self.measured = gui.add_html("")
        self.save = gui.add_button_group(
            "Save", tuple(SAVE), hint="A picture of the scene, or the selected frames"
        )
        self.follow = gui.add_checkbox("Follow", True, hint="Keep the pelvis in the middle")
        bones = gui.add_checkbox("Bones", True)
        tint = gui.add_dropdown("Bones show", TINTS, hint="What their colour says; the legend has the scale")
        see_through = gui.add_checkbox("See-through", False)
        model_markers = gui.add_checkbox("Model markers", True)
        forces = gui.add_checkbox("Forces", True)
        required = gui.add_checkbox(
            "Missing forces", True, hint="What the motion demands of a foot whose force is missing, hollow"
        )
        residual = gui.add_checkbox(
            "Residual", True, hint="Force that F = ma still lacks, at the centre of mass"
        )
        total = gui.add_checkbox(
            "Total force", True, hint="At the centre of mass: measured, and hollow, required by the motion"
        )
        causes = gui.add_checkbox("Named causes", True, hint="What the diagnosis names, where it acts")
        trails = gui.add_slider("Trails [s]", 0.0, TRAIL_LONGEST, 0.1, 0.0)
        self.dark = gui.add_checkbox("Dark", dark, hint="Dark theme")
        self.legend = gui.add_html("")
        self.switches: dict[str, viser.GuiInputHandle[Any]] = {
            "bones": bones,
            "tint": tint,
            "see_through": see_through,
            "model_markers": model_markers,
            "forces": forces,
            "required": required,
            "residual": residual,
            "total": total,
            "causes": causes,
            "trail_seconds": trails,
        }  # those that change the picture, by the scene's option


class Controls:
    """What the reviewer operates, and the tabs in which panels lay out what is theirs."""

    def __init__(self, gui: viser.GuiApi, views: tuple[str, ...], *, dark: bool) -> None:
        """Lay out the panel; nothing is bound to anything yet.

        Args:
            gui: of the browser.
            views: names of the camera's views.
            dark: the present theme.
        """
        tabs = gui.add_tab_group()
        self.review = tabs.add_tab("Review")
        self.solve, self.view = tabs.add_tab("Solve"), tabs.add_tab("View")
        with self.view:
            self.show = Show(gui, views, dark=dark)
        self.fit = FitTab(gui, tabs.add_tab("Fit"))


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
