"""What one browser is asked: one thing at a time, in a dialog that keeps the keys until it is answered."""

import html
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

import viser

from addb_viewer.app.page.notices import Notices
from addb_viewer.trial_view.html_pieces import boxed
from annotations.errors import ReviewError
from annotations.events import IMPORTED

if TYPE_CHECKING:
    from viser._gui_handles import GuiModalHandle

Then = Callable[[], None]
LONGEST_NAME = 60  # characters: it stands beside every edit


class Questions:
    """Asks the person at one browser. What cannot be taken back, or is another person's, is asked first."""

    def __init__(self, gui: viser.GuiApi, notices: Notices) -> None:
        self._gui, self._notices = gui, notices
        self._open: GuiModalHandle | None = None
        self._then: Then | None = None
        self._options: Mapping[str, Then] = {}  # by key

    @property
    def waits(self) -> bool:
        """Whether a dialog is open: keys other than its own are for nobody."""
        return self._open is not None

    def ask(
        self,
        title: str,
        reasons: Sequence[str],
        yes: str,
        then: Then,
        *,
        no: str = "Go back",
        also: tuple[str, Then] | None = None,
    ) -> None:
        """Ask whether to go on; Escape and the first button leave everything as it is.

        Args:
            title: the question.
            reasons: why it is asked, one paragraph each; shown as text.
            yes: what the other button says.
            then: done on yes, after all that was asked for before.
            no: what the first button says.
            also: a third button, and what it does.
        """
        self.no()
        modal = self._gui.add_modal(title)
        with modal:
            self._gui.add_html(boxed("".join(f"<p>{html.escape(reason)}</p>" for reason in reasons)))
            stay = self._gui.add_button(f"{no} (Esc)", color="gray")  # the first one has the focus
            go = self._gui.add_button(f"{yes} (Y)")
            third = None if also is None else self._gui.add_button(also[0])
        stay.on_click(self._notices.in_order("Answering", self.no))
        go.on_click(self._notices.in_order(yes, self.yes))
        if third is not None and also is not None:
            third.on_click(self._notices.in_order(also[0], lambda: self._instead(modal, also[1])))
        self._open, self._then = modal, then

    def offer(
        self, title: str, options: Sequence[tuple[str, str, Then]], yes: tuple[str, Then] | None = None
    ) -> None:
        """Let a person choose one of several things, by its key or its button; Escape chooses none.

        Args:
            title: what is chosen.
            options: each with its key, empty where it has none; what its button says; and what it does.
            yes: what Y does, where one of them is the likeliest.
        """
        self.no()
        modal = self._gui.add_modal(title)
        with modal:
            stay = self._gui.add_button("Go back (Esc)", color="gray")
            buttons = [] if yes is None else [(self._gui.add_button(f"{yes[0]} (Y)"), yes[1])]
            for key, words, then in options:
                button = self._gui.add_button(f"{words} ({key})" if key else words, color="gray")
                buttons.append((button, then))
        stay.on_click(self._notices.in_order("Answering", self.no))
        for button, then in buttons:
            button.on_click(self._notices.in_order(title, partial(self._instead, modal, then)))
        self._open, self._then = modal, None if yes is None else yes[1]
        self._options = {key: then for key, _, then in options if key}

    def show(self, title: str, content: str) -> None:
        """Show something until Escape.

        Args:
            title: what it is.
            content: safe HTML.
        """
        self.no()
        modal = self._gui.add_modal(title)
        with modal:
            self._gui.add_html(content)
            stay = self._gui.add_button("Close (Esc)", color="gray")
        stay.on_click(self._notices.in_order("Closing", self.no))
        self._open, self._then = modal, None

    def choose(self, key: str) -> None:
        """Take the option of a key; nothing where none has it."""
        then = self._options.get(key)
        if then is not None:
            self._close()
            then()

    def ask_name(self, suggested: str, then: Callable[[str], None]) -> None:
        """Ask who is here.

        Args:
            suggested: stands in the box already.
            then: takes the name; a text that cannot be one leaves the dialog open, and it says why.
        """
        self.no()
        modal = self._gui.add_modal("Who is reviewing?")
        with modal:
            self._gui.add_html(
                boxed(
                    "<p data-addb-dialog='name'>Your name stands by every decision that you make, and U "
                    "takes back yours only. This browser remembers it; change it under Review, "
                    "<i>Who did what</i>.</p>"
                )
            )
            box = self._gui.add_text("Your name", suggested)
            wrong = self._gui.add_html("", visible=False)
            go = self._gui.add_button(
                "Decide under this name (Enter)"
            )  # the first one is Enter's: by a script
            stay = self._gui.add_button("Not now", color="gray")

        def answered() -> None:
            if self._open is not modal:
                return
            try:
                name = checked_name(box.value)
            except ReviewError as error:
                wrong.content, wrong.visible = boxed(f"<b>{html.escape(str(error))}</b>"), True
                return
            self._close()
            then(name)

        go.on_click(self._notices.in_order("Taking your name", answered))
        stay.on_click(self._notices.in_order("Answering", self.no))
        self._open, self._then = modal, None

    def yes(self) -> None:
        """Do what was asked about; nothing where a name is asked for, or nothing at all."""
        then = self._then
        if then is not None:
            self._close()
            then()

    def _instead(self, modal: "GuiModalHandle", then: Then) -> None:
        if self._open is modal:
            self._close()
            then()

    def no(self) -> None:
        """Leave everything as it is."""
        if self._open is not None:
            self._close()

    def _close(self) -> None:
        assert self._open is not None
        modal, self._open, self._then = self._open, None, None
        self._options = {}
        modal.close()


def checked_name(text: str) -> str:
    """A person's name, as it is to stand beside edits.

    Raises:
        ReviewError: it cannot be one; says why.
    """
    name = " ".join(text.split())
    if not name:
        raise ReviewError("a decision needs a name; type yours")
    if name == IMPORTED:
        raise ReviewError(f"'{IMPORTED}' stands for labels from files; take another name")
    if len(name) > LONGEST_NAME or not name.isprintable():
        raise ReviewError(f"a name has at most {LONGEST_NAME} characters, all of which can be read")
    return name
