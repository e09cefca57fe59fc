"""The Review panel: what keys are about, proposals, what does not count, and how far the review is."""

from dataclasses import dataclass

import viser

from addb_viewer.app.page.handles import put
from addb_viewer.app.review.comments import CommentsPanel, build_comments
from addb_viewer.app.review.html import reasons_html
from annotations.activities import ACTIVITIES
from annotations.foot_names import foot_words
from annotations.reasons import OTHER_WORDS

FOOT, DECIDE, FINISH = "Foot", ("Accept", "Reject", "Next"), ("Finish", "Second look")
EDITS = ("Undo", "Redo")
SUGGESTION = ("Confirm", "Refuse")
WHOLE = "whole trial"


@dataclass(frozen=True)
class ReviewPanel:
    """Handles of the panel."""

    author: viser.GuiHtmlHandle
    rename: viser.GuiButtonHandle
    status: viser.GuiHtmlHandle
    finish: viser.GuiButtonGroupHandle
    foot: viser.GuiDropdownHandle[str]
    selection: viser.GuiHtmlHandle
    note: viser.GuiTextHandle
    proposals: viser.GuiHtmlHandle
    decide: viser.GuiButtonGroupHandle
    ranges: viser.GuiHtmlHandle
    edits: viser.GuiButtonGroupHandle
    what_if: viser.GuiButtonHandle
    answer: viser.GuiHtmlHandle
    reason: viser.GuiDropdownHandle[str]
    paint: viser.GuiButtonHandle
    suggested: viser.GuiHtmlHandle
    suggestion: viser.GuiButtonGroupHandle
    activity: viser.GuiDropdownHandle[str]
    label: viser.GuiButtonHandle
    comments: CommentsPanel
    history: viser.GuiHtmlHandle

    @property
    def next_note(self) -> str:
        """The note for the next edit; it stays in its box until that is recorded."""
        return str(self.note.value).strip()

    def drop_note(self, note: str) -> None:
        """Empty the box, unless something else was typed into it."""
        if self.next_note == note:
            put(self.note, "")


def build_review(gui: viser.GuiApi, tab: viser.GuiTabHandle, feet: tuple[str, ...]) -> ReviewPanel:
    """Lay out the panel; nothing is bound to anything yet.

    Args:
        gui: of the browser.
        tab: where.
        feet: of the subject.
    """
    with tab:
        status = gui.add_html("")
        finish = gui.add_button_group("Trial", FINISH, hint="Key T finishes and goes on to the next")
        selection = gui.add_html("")
        foot = gui.add_dropdown(FOOT, feet_words(feet), initial_value="both", hint="Key F")
        with gui.add_folder("Proposals"):
            decide = gui.add_button_group("Decide", DECIDE, hint="Keys Enter, Backspace, N")
            proposals = gui.add_html("")
        with gui.add_folder("Flags"):
            ranges = gui.add_html("")
            edits = gui.add_button_group("Edits", EDITS, hint="Keys U and R")
            what_if = gui.add_button(
                "What if flipped?",
                icon=viser.Icon.QUESTION_MARK,
                color="gray",
                hint="The residual if the selected frames counted, or no longer did",
            )
            answer = gui.add_html("")
        with gui.add_folder("Reasons and labels"):
            gui.add_html(reasons_html())
            note = gui.add_text("Note", "", hint="Goes with the next flag or label")
            reason = gui.add_dropdown("Reason", other_reasons(), hint="Those that no key stands for")
            paint = gui.add_button("Flag with this reason", color="gray")
        with gui.add_folder("What the person does"):
            suggested = gui.add_html("")
            suggestion = gui.add_button_group(
                "Suggestion", SUGGESTION, hint="The one that is selected, or under the cursor"
            )
            activity = gui.add_dropdown("Activity", activity_names(), hint="What the person does")
            label = gui.add_button(
                "Label the selection", color="gray", hint="The whole trial where nothing is selected"
            )
        with gui.add_folder("Comments"):
            comments = build_comments(gui)
        with gui.add_folder("Who did what"):
            author = gui.add_html("")
            rename = gui.add_button("Change your name", color="gray")
            history = gui.add_html("")
    return ReviewPanel(
        author, rename, status, finish, foot, selection, note, proposals, decide, ranges, edits, what_if,
        answer, reason, paint, suggested, suggestion, activity, label, comments, history,
    )  # fmt: skip


def feet_words(feet: tuple[str, ...]) -> tuple[str, ...]:
    """What can be chosen from the list of feet."""
    return (*(foot_words(foot) for foot in feet), "both")


def other_reasons() -> tuple[str, ...]:
    """The B3D format's reasons that no key stands for, in words."""
    return tuple(OTHER_WORDS.values())


def activity_names() -> tuple[str, ...]:
    """Activities, each followed by its subclasses."""
    return tuple(
        name
        for activity, subclasses in ACTIVITIES.items()
        for name in (activity, *(f"{activity}, {subclass}" for subclass in subclasses))
    )


def activity_named(name: str) -> tuple[str, str | None]:
    """Activity and subclass of a name in the list."""
    activity, _, subclass = name.partition(", ")
    return activity, subclass or None
