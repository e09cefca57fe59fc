"""The Review panel: proposals, what does not count, labels and words."""

import viser

from addb_viewer.app.page.handles import put
from addb_viewer.app.review.comments import CommentsPanel
from addb_viewer.app.review.review_html import reasons_html
from annotations.activities import ACTIVITIES
from annotations.reasons import OTHER_WORDS

SUGGESTION = ("Confirm", "Refuse")


class ReviewPanel:
    """Handles of the panel."""

    def __init__(self, gui: viser.GuiApi, tab: viser.GuiTabHandle) -> None:
        """Lay out the panel; nothing is bound to anything yet."""
        with tab:
            self.answer = gui.add_html("")
            with gui.add_folder("Proposals"):
                self.proposals = gui.add_html("")
            with gui.add_folder("Flags"):
                self.ranges = gui.add_html("")
            with gui.add_folder("Reasons and notes", expand_by_default=False):
                gui.add_html(reasons_html())
                self.note = gui.add_text("Note", "", hint="Goes with the next flag or label")
                self.reason = gui.add_dropdown("Reason", other_reasons(), hint="Those that no key stands for")
                self.paint = gui.add_button("Flag with this reason", color="gray")
            with gui.add_folder("Activity", expand_by_default=False):
                self.suggested = gui.add_html("")
                self.suggestion = gui.add_button_group(
                    "Suggestion", SUGGESTION, hint="The one that is selected, or under the cursor"
                )
                self.activity = gui.add_dropdown("Label", activity_names(), hint="What the person does")
                self.label = gui.add_button(
                    "Label the selection", color="gray", hint="The whole trial where nothing is selected"
                )
            with gui.add_folder("Comments", expand_by_default=False):
                self.comments = CommentsPanel(gui)
            with gui.add_folder("History", expand_by_default=False):
                self.author = gui.add_html("")
                self.rename = gui.add_button("Change your name", color="gray")
                self.history = gui.add_html("")

    @property
    def next_note(self) -> str:
        """The note for the next edit; it stays in its box until that is recorded."""
        return str(self.note.value).strip()

    def drop_note(self, note: str) -> None:
        """Empty the box, unless something else was typed into it."""
        if self.next_note == note:
            put(self.note, "")


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
