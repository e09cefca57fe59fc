"""Comments on the trial on the screen: said at a frame, answered by others, settled."""

import html
from collections.abc import Sequence

import viser

from addb_viewer.app.page.handles import put
from addb_viewer.app.page.screen import Screen
from addb_viewer.trial_view.html_pieces import boxed
from annotations.review_errors import ReviewError
from annotations.work import Comment, CommentThread, Settle, WorkItem

NEW = "new, at this frame"
LONGEST = 40  # letters of a comment in the list of those that can be answered


class CommentsPanel:
    """Handles of the panel."""

    def __init__(self, gui: viser.GuiApi) -> None:
        """Lay out the panel; nothing is bound to anything yet."""
        self.shown = gui.add_html("")
        self.about = gui.add_dropdown("About", (NEW,), hint="A new comment, or the one that is answered")
        self.words = gui.add_text("Comment", "", multiline=True)
        self.say = gui.add_button("Say it", color="gray", hint="At this frame, or as an answer")
        self.settle = gui.add_button(
            "Settled, or open again", color="gray", hint="The comment that is chosen"
        )


class Comments:
    """What is said about the trial."""

    def __init__(self, screen: Screen, panel: CommentsPanel) -> None:
        self._screen, self._panel = screen, panel
        self._of = ("", "")
        self._comments: tuple[CommentThread, ...] = ()

    def show(self) -> None:
        """Put them on the screen; the talk that was chosen stays so while the trial does."""
        replay, panel = self._screen.replay, self._panel
        if replay is None:
            return
        place = (self._screen.shared.name, replay.name)
        self._comments = self._screen.shared.reviews.work(replay.name).comments
        content, options = comments_html(self._comments), (NEW, *map(_name, self._comments))
        if panel.shown.content != content:
            panel.shown.content = content
        chosen = panel.about.value if place == self._of and panel.about.value in options else NEW
        if panel.about.options != options:
            panel.about.options = options
        put(panel.about, chosen)
        self._of = place

    def say(self) -> None:
        """Say what was written: a new comment at this frame, or an answer to the chosen one.

        Raises:
            ReviewError: nothing was written, or it cannot be recorded.
        """
        thread, text = self._chosen(), self._panel.words.value
        author, trial = self._screen.reviewer.author(), self._trial()
        if thread is None:
            self._screen.shared.reviews.say(trial, Comment(text, self._screen.frame), author)
        else:
            self._screen.shared.answer(trial, thread, text, author)
        self.show()
        put(self._panel.words, "")

    def settle(self) -> None:
        """The chosen talk is settled, or open again.

        Raises:
            ReviewError: none is chosen, or it cannot be recorded.
        """
        thread = self._chosen()
        if thread is None:
            raise ReviewError("choose the comment that is settled")
        event, author = Settle(thread.number, not thread.settled_by), self._screen.reviewer.author()
        self._screen.shared.reviews.say(self._trial(), event, author)
        self.show()

    def _chosen(self) -> CommentThread | None:
        return next((thread for thread in self._comments if _name(thread) == self._panel.about.value), None)

    def _trial(self) -> str:
        replay = self._screen.replay
        assert replay is not None
        return replay.name


def _name(thread: CommentThread) -> str:
    """As the list has it; the number keeps two alike apart."""
    where = "" if thread.frame is None else f"frame {thread.frame}, "
    text = _text(thread.first)
    short = text if len(text) <= LONGEST else f"{text[:LONGEST]}…"
    return f"{thread.number}. {where}{thread.first.author}: {short}"


def _text(item: WorkItem) -> str:
    return item.event.text if isinstance(item.event, Comment) else ""


def comments_html(comments: Sequence[CommentThread]) -> str:
    """All comments, those that are settled last and in short; a click on a frame goes there."""
    if not comments:
        return boxed("<span style='opacity:.75'>No comments on this trial.</span>")
    return boxed(
        "".join(
            _thread_html(thread) for thread in sorted(comments, key=lambda thread: bool(thread.settled_by))
        )
    )


def _thread_html(thread: CommentThread) -> str:
    goes, about = "", "whole trial"
    if thread.frame is not None:
        goes, about = f" data-addb-go-to='{thread.frame}' style='cursor:pointer'", f"frame {thread.frame}"
    said = (thread.first,) if thread.settled_by else (thread.first, *thread.answers)
    lines = "".join(
        f"<div style='overflow-wrap:anywhere;white-space:pre-wrap'><b>{html.escape(item.author)}</b>: "
        f"{html.escape(_text(item))}</div>"
        for item in said
    )
    settled = f", settled by {html.escape(thread.settled_by)}" if thread.settled_by else ""
    faint = "opacity:.75;" if thread.settled_by else ""
    return (
        f"<div style='{faint}border-top:1px solid rgba(128,128,128,.3);padding:.2em 0'>"
        f"<div{goes}>{about}{settled}</div>{lines}</div>"
    )
