"""The Solve panel: run, progress, cancel, what changed, keep or discard, earlier solves."""

from dataclasses import dataclass
from typing import Any

import viser

BEFORE = "the fit before"  # the kept one while a new one waits, else the last one that was replaced


@dataclass(frozen=True)
class SolvePanel:
    """Handles of the panel."""

    solve: viser.GuiButtonHandle
    hold_out: viser.GuiButtonHandle
    cancel: viser.GuiButtonHandle
    bar: Any  # viser exports no name for its class
    status: viser.GuiHtmlHandle
    verdict: viser.GuiHtmlHandle
    keep: viser.GuiButtonHandle
    discard: viser.GuiButtonHandle
    compare: viser.GuiCheckboxHandle
    changed: viser.GuiHtmlHandle
    other: viser.GuiDropdownHandle[str]
    history: viser.GuiHtmlHandle
    settings: viser.GuiHtmlHandle


def build_solve(gui: viser.GuiApi, tab: viser.GuiTabHandle) -> SolvePanel:
    """Lay out the panel; nothing is bound to anything yet."""
    with tab:
        solve = gui.add_button(
            "Solve again", icon=viser.Icon.REFRESH, hint="With the present flags and decisions; key G"
        )
        hold_out = gui.add_button(
            "Judge held-out forces",
            icon=viser.Icon.SCALE,
            visible=False,
            color="gray",
            hint="Fits again without some of the forces, layout by layout; gives way to all other work",
        )
        cancel = gui.add_button("Cancel", icon=viser.Icon.X, visible=False, color="gray")
        bar = gui.add_progress_bar(0.0, visible=False, animated=True)
        status = gui.add_html("", visible=False)
        verdict = gui.add_html("", visible=False)
        keep = gui.add_button(
            "Keep", icon=viser.Icon.CHECK, visible=False, hint="It becomes the subject's fit"
        )
        discard = gui.add_button(
            "Discard", icon=viser.Icon.TRASH, visible=False, color="gray", hint="The fit before stays"
        )
        with gui.add_folder("What changed"):
            compare = gui.add_checkbox("Compare", False, hint="Key M: the other solve in scene and charts")
            other = gui.add_dropdown("Compare with", (BEFORE,))
            changed = gui.add_html("")
        with gui.add_folder("Solves"):
            history = gui.add_html("")
            settings = gui.add_html("")
    return SolvePanel(
        solve,
        hold_out,
        cancel,
        bar,
        status,
        verdict,
        keep,
        discard,
        compare,
        changed,
        other,
        history,
        settings,
    )
