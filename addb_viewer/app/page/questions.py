"""What one browser is asked: one thing at a time, in a dialog that keeps the keys until it is answered."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Any

from addb_viewer.app.page.channel import Channel
from addb_viewer.app.page.notices import Notices
from annotations.events import IMPORTED
from annotations.review_errors import ReviewError

Then = Callable[[], None]
Answer = tuple[str, Callable[[str], None]]  # what its button says, and what it does with what was typed
LONGEST_NAME = 60  # characters: it stands beside every edit


@dataclass(frozen=True)
class Dialog:
    """What the page shows of a question; all but `html` is shown as text."""

    number: int
    title: str
    buttons: tuple[str, ...]
    paragraphs: tuple[str, ...] = ()
    html: str = ""
    field: dict[str, str] | None = None  # its label, and the value that stands there
    wrong: str = ""  # what is wrong with what was typed
    keys: tuple[str, ...] = ()  # actions whose keys stand for the first buttons
    enter: int = 0  # the button that Enter stands for
    escape: int = 0  # likewise


class Questions:
    """Asks the person at one browser. What cannot be taken back, or is another person's, is asked first."""

    def __init__(self, channel: Channel, notices: Notices) -> None:
        self._channel, self._notices = channel, notices
        self._number = 0
        self._open: Dialog | None = None
        self._answers: Sequence[Answer] = ()
        self._then: Then | None = None
        self._options: Mapping[str, Then] = {}  # by key
        channel.on("answer", self._answered)

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
            reasons: why it is asked, one paragraph each.
            yes: what the other button says.
            then: done on yes, after all that was asked for before.
            no: what the first button says.
            also: a third button, and what it does.
        """
        others = [also] if also else []
        buttons = [(f"{no} (Esc)", _nothing), (f"{yes} (Y)", then), *others]
        self._show(title, self._closing(buttons), yes=then, paragraphs=tuple(reasons))

    def decide(self, title: str, reasons: Sequence[str], options: Sequence[tuple[str, str, Then]]) -> None:
        """Ask what to do in view of some reasons; Escape does nothing.

        Args:
            title: the question.
            reasons: a paragraph each.
            options: each with the action whose key chooses it, what its button says, and what it does.
        """
        answers = self._closing([*((words, then) for _, words, then in options), ("Go back (Esc)", _nothing)])
        keys = tuple(action for action, _, _ in options)
        self._show(title, answers, paragraphs=tuple(reasons), keys=keys, escape=len(options))
        self._options = {action: then for action, _, then in options}

    def offer(
        self, title: str, options: Sequence[tuple[str, str, Then]], yes: tuple[str, Then] | None = None
    ) -> None:
        """Let a person choose one of several things, by its key or its button; Escape chooses none.

        Args:
            title: what is chosen.
            options: each with its key, empty where it has none; what its button says; and what it does.
            yes: what Y does, where one of them is the likeliest.
        """
        likeliest = [] if yes is None else [(f"{yes[0]} (Y)", yes[1])]
        others = [(f"{words} ({key})" if key else words, then) for key, words, then in options]
        buttons = [("Go back (Esc)", _nothing), *likeliest, *others]
        self._show(title, self._closing(buttons), yes=yes[1] if yes else None)
        self._options = {key: then for key, _, then in options if key}

    def show(self, title: str, content: str) -> None:
        """Show something until Escape.

        Args:
            title: what it is.
            content: safe HTML.
        """
        self._show(title, self._closing([("Close (Esc)", _nothing)]), html=content)

    def choose(self, key: str) -> None:
        """Take the option of a key; nothing where none has it."""
        then = self._options.get(key)
        if then is not None:
            self.no()
            then()

    def ask_name(self, suggested: str, then: Callable[[str], None]) -> None:
        """Ask who is here.

        Args:
            suggested: stands in the box already.
            then: takes the name.
        """
        reason = (
            "Your name stands by every decision that you make, and U takes back yours only. This browser "
            "remembers it; change it under Review, “History”."
        )

        answers = {"Decide under this name": lambda text: then(checked_name(text))}
        self.ask_text("Who is reviewing?", "Your name", suggested, answers, (reason,))

    def ask_text(
        self,
        title: str,
        label: str,
        value: str,
        answers: Mapping[str, Callable[[str], None]],
        reasons: Sequence[str] = (),
    ) -> None:
        """Ask for a text; one that is refused leaves the dialog open, and it says why.

        Args:
            title: the question.
            label: of the box.
            value: stands in the box already.
            answers: what each button says, and what it does with the text; Enter stands for the first.
            reasons: a paragraph each.
        """

        def taken(then: Callable[[str], None], text: str) -> None:
            asked = self._open
            try:
                then(text)
            except ReviewError as error:
                if asked is not None:
                    self._put(replace(asked, wrong=str(error)))
                return
            if self._open is asked:
                self.no()

        first = next(iter(answers))
        named: list[Answer] = [
            (f"{words} (Enter)" if words == first else words, partial(taken, then))
            for words, then in answers.items()
        ]
        field = {"label": label, "value": value}
        buttons = [*named, *self._closing([("Go back (Esc)", _nothing)])]
        self._show(title, buttons, paragraphs=tuple(reasons), field=field, escape=len(named))

    def yes(self) -> None:
        """Do what was asked about; nothing where a name is asked for, or nothing at all."""
        then = self._then
        if then is not None:
            self.no()
            then()

    def no(self) -> None:
        """Leave everything as it is."""
        if self._open is not None:
            self._answers, self._then, self._options = (), None, {}
            self._put(None)

    def _show(self, title: str, answers: Sequence[Answer], yes: Then | None = None, **more: Any) -> None:
        """Open a dialog in place of the one before."""
        self.no()
        self._number += 1
        self._answers, self._then = answers, yes
        self._put(Dialog(self._number, title, tuple(words for words, _ in answers), **more))

    def _closing(self, buttons: Sequence[tuple[str, Then]]) -> list[Answer]:
        """Buttons that close the dialog before they do what they are for."""

        def closed(then: Then, typed: str) -> None:
            self.no()
            then()

        return [(words, partial(closed, then)) for words, then in buttons]

    def _put(self, dialog: Dialog | None) -> None:
        self._open = dialog
        self._channel.show("dialog", None if dialog is None else asdict(dialog))

    def _answered(self, said: Any) -> None:
        """The page says which button was pressed, and what was typed."""
        match said:
            case {"dialog": int(number), "button": int(button), "text": str(typed)}:
                self._notices.obey("Answering", lambda: self._take(number, button, typed))

    def _take(self, number: int, button: int, typed: str) -> None:
        if self._open is not None and self._open.number == number and 0 <= button < len(self._answers):
            self._answers[button][1](typed)


def _nothing() -> None:
    """What a button does that only closes the dialog."""


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
