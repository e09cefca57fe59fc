"""The Diagnosis panel: verdict, causes, what they gain, and whether they become part of the model."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import viser

from addb_viewer.app.diagnosis.diagnosis_html import (
    gain_html,
    section_html,
    text_html,
    verdict_html,
)
from addb_viewer.app.page.notices import Notices
from addb_viewer.text.cause_words import cause
from addb_viewer.text.detectable_words import what_would_be_found
from addb_viewer.text.diagnosis_vocabulary import about, short_title
from addb_viewer.text.diagnosis_words import notes
from addb_viewer.text.direct_check_words import what_the_files_say
from addb_viewer.text.extension_words import what_accepting_changes
from addb_viewer.text.holding_up_words import what_it_gains
from addb_viewer.text.remainder_words import what_next, what_remains
from addb_viewer.trial_view.diagnosis_state import DiagnosisState, decision_in_words
from annotations.foot_names import foot_words
from annotations.reasons import key_of
from solver.diagnosis.diagnosis_report import Cause, DiagnosisReport

PLACE = "<div data-addb-diagnosis></div>"  # where the page's script puts verdict, cards and picture
JUMPS_A_ROW = 3
LONGEST_HEADING = 44  # characters that fit on a line


@dataclass(frozen=True)
class Actions:
    """What the panel's buttons do."""

    diagnose: Callable[[], None]
    accept: Callable[[], None]
    reject: Callable[[], None]
    fit: Callable[[], None]
    go_to: Callable[[str, int], None]  # trial, frame


class DiagnosisPanel:
    """Owns what is inside one tab."""

    def __init__(
        self,
        gui: viser.GuiApi,
        tab: viser.GuiTabHandle,
        actions: Actions,
        notices: Notices,
    ) -> None:
        self.gui, self.actions, self.notices = gui, actions, notices
        self.parts: list[Any] = []
        with tab:
            self.diagnose = gui.add_button("Diagnose", icon=viser.Icon.STETHOSCOPE, hint="Key X")
            self.status = gui.add_html("", visible=False)
            self.place = gui.add_html("")
            self.verdict = gui.add_folder("The verdict in full", expand_by_default=False)
            with self.verdict:
                self.in_full = gui.add_html("")
            self.causes = gui.add_folder(None)
            with gui.add_folder("All causes together", expand_by_default=False):
                self.echo = gui.add_html("")
                self.gain = gui.add_html("", visible=False)
                self.accept = gui.add_button(
                    "Accept all",
                    icon=viser.Icon.CHECK,
                    hint="Later fits use all named causes beside the forces",
                )
                self.reject = gui.add_button(
                    "Reject all",
                    icon=viser.Icon.BAN,
                    color="gray",
                    hint="Later fits use the recorded forces alone",
                )
                self.fit = gui.add_button(
                    "Solve again",
                    icon=viser.Icon.REFRESH,
                    color="gray",
                    hint="With the decisions above and the present flags",
                )
        for button, doing, action in (
            (self.diagnose, "Diagnosing", actions.diagnose),
            (self.accept, "Accepting", actions.accept),
            (self.reject, "Rejecting", actions.reject),
            (self.fit, "Fitting", actions.fit),
        ):
            button.on_click(notices.in_order(doing, action))

    def show(self, state: DiagnosisState, trials: Sequence[str]) -> None:
        """Put a state in place of the one that is shown.

        Args:
            state: of the subject.
            trials: that one can go to.
        """
        asked = state.figures is not None
        self.place.content = PLACE if asked else verdict_html(None)
        self.in_full.content = verdict_html(state.figures, state.changed) if asked else ""
        self.verdict.visible = asked
        self.diagnose.visible = not asked
        for part in self.parts:
            part.remove()
        self.parts = []
        with self.causes:
            if state.figures is not None:
                self._add_causes(state.figures, trials)
        self.echo.content = text_html(decision_in_words(state) or "Nobody has decided yet.", bold=True)
        self.gain.visible = state.gain is not None
        if state.gain is not None:
            section = what_accepting_changes(state.gain)
            self.gain.content = text_html(section.heading, bold=True) + gain_html(section)
        self.accept.disabled, self.reject.disabled = not state.acceptable, not state.rejectable

    def said(self, text: str) -> None:
        """Show how the work ended."""
        self.status.visible = bool(text)
        self.status.content = text_html(text)

    def _add_causes(self, figures: DiagnosisReport, trials: Sequence[str]) -> None:
        for k, effect in enumerate(figures.effects):
            section = cause(figures, k, by_key)
            self.parts.append(folder := self._folder(_heading(k + 1, effect)))
            with folder:
                self.gui.add_html(section_html(section, spread=bool(effect.parameters)))
                self._add_jumps(figures, effect, trials)
        for section, shown in (
            (what_the_files_say(figures), section_html),
            (what_would_be_found(figures), section_html),
            (what_it_gains(figures), gain_html),
            (what_remains(figures), section_html),
            (what_next(figures), section_html),
            (notes(figures), section_html),
        ):
            if section.lines or section.rows:
                self.parts.append(folder := self._folder(section.heading))
                with folder:
                    self.gui.add_html(shown(section))

    def _folder(self, heading: str) -> viser.GuiFolderHandle:
        """What is folded until somebody wants to know it."""
        return self.gui.add_folder(heading, expand_by_default=False)

    def _add_jumps(self, figures: DiagnosisReport, effect: Cause, trials: Sequence[str]) -> None:
        """Buttons that lead to the frames of a cause that acts only there."""
        if not about(effect).at_certain_frames:
            return
        places = [(trial, start, end) for trial, start, end in effect.frames if trial in trials]
        several = len({trial for trial, _, _ in places}) > 1
        named = {
            f"{trial + ' ' if several else ''}{start}–{end - 1}": (trial, start)
            for trial, start, end in places
        }
        labels = list(named)
        for first in range(0, len(labels), JUMPS_A_ROW):
            group = self.gui.add_button_group("Go to", labels[first : first + JUMPS_A_ROW])

            def jump(event: viser.GuiEvent[Any], named: dict[str, tuple[str, int]] = named) -> None:
                self.actions.go_to(*named[event.target.value])

            group.on_click(self.notices.guard("Going there", jump))


def by_key(trial: str, start: int, end: int, foot: str) -> str:
    """How to flag frames in the app."""
    key = key_of("notOverForcePlate")
    where = f"in {trial} select {start}–{end - 1} (drag over the timeline)"
    return f"{where}, choose the foot {foot_words(foot)} (F), press {key}"


def _heading(number: int, effect: Cause) -> str:
    """Number and name of a cause on one line, without the model's name of what is told in words."""
    words = short_title(effect)
    if len(words) > LONGEST_HEADING:
        words = words.split(": ")[0]
    return f"{number} · {words}"
