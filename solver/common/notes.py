"""What was assumed, ignored or looks wrong, as a sentence that knows what it is about.

A note is made where the thing is found, with its kind; whoever reads it sorts and shows it by that, never by
its words.
"""

from collections.abc import Callable, Mapping
from enum import Enum
from typing import Literal, TypedDict

Severity = Literal["decide", "know"]
Value = str | float


class Kind(Enum):
    """What notes have in common, in order of harm: a heading, and whether somebody has to choose or look."""

    SEVERAL_PEOPLE = "several people", "decide"
    NOT_READ = "not read", "decide"
    FORCES_AGAINST_BODY = "forces against the body", "decide"
    ENTERED_MASS = "the entered mass", "decide"
    GUESS = "a guess", "decide"
    MODEL_AGAINST_MARKERS = "model against markers", "decide"
    PELVIS = "the pelvis", "decide"
    FAR_MARKERS = "markers far from the model", "decide"
    WRONG_LABELS = "labels on the wrong marker", "decide"
    UNUSED_LABELS = "labels not used", "decide"
    REVIEWS = "reviews", "decide"
    SOLVE = "the solve", "decide"
    OUT_OF_VIEW = "out of view", "decide"
    DETECTED = "steps that detection sees", "decide"
    OTHER = "other notes", "decide"
    DRAWING = "drawing", "know"
    LABELS = "labels", "know"
    BARE_BODIES = "bodies without markers", "know"
    PLATES = "axes, units and plates", "know"
    PERSON = "the person", "know"
    LEFT_OUT = "frames and values left out", "know"

    def __init__(self, heading: str, severity: Severity) -> None:
        self.heading = heading
        self.severity = severity


class NoteJson(TypedDict):
    """A note in JSON."""

    kind: str  # name of its kind, in small letters
    severity: Severity
    trial: str | None
    text: str  # the whole sentence
    advice: str
    values: dict[str, Value]


class Note(str):
    """A sentence with its kind; it reads, compares and sorts as its text, and never changes."""

    kind: Kind
    trial: str | None
    advice: str
    values: Mapping[str, Value]

    def __new__(
        cls,
        kind: Kind,
        text: str,
        *,
        trial: str | None = None,
        advice: str = "",
        values: Mapping[str, Value] | None = None,
    ) -> "Note":
        """The sentence, its trial's name first and its advice last.

        Args:
            kind: what it is about.
            text: the sentence.
            trial: whose recording it is about; None: about the subject.
            advice: the end of the sentence, after a semicolon: what to do or to check.
            values: figures and names that the sentence is made of.
        """
        before = "" if trial is None or text.startswith(f"{trial}: ") else f"{trial}: "
        ending = f"; {advice}" if advice else ""
        return cls._whole(kind, before + text + ending, trial, advice, values or {})

    @classmethod
    def _whole(
        cls, kind: Kind, text: str, trial: str | None, advice: str, values: Mapping[str, Value]
    ) -> "Note":
        """The note whose whole sentence is known."""
        note = super().__new__(cls, text)
        note.__dict__.update(kind=kind, trial=trial, advice=advice, values=dict(values))
        return note

    def __setattr__(self, name: str, value: object) -> None:
        """Refused: a note is what it was when it was made."""
        raise AttributeError(f"a note does not change: {name}")

    def __reduce__(self) -> tuple[Callable[..., "Note"], tuple[object, ...]]:
        """What it is made of, for processes that send it to each other."""
        return Note._whole, (self.kind, str(self), self.trial, self.advice, self.values)

    @property
    def without_advice(self) -> str:
        """What was noticed, less what to do about it."""
        return self.removesuffix(f"; {self.advice}") if self.advice else str(self)

    def reworded(self, change: Callable[[str], str]) -> "Note":
        """The same with another sentence."""
        return Note._whole(self.kind, change(str(self)), self.trial, self.advice, self.values)

    def of(self, what: str) -> "Note":
        """The same with what it is about before it, unless that stands there."""
        return self if self.startswith(f"{what}: ") else self.reworded(lambda text: f"{what}: {text}")

    def in_trial(self, trial: str) -> "Note":
        """The same, told of a trial; its name comes first."""
        return Note._whole(self.kind, str(self.of(trial)), trial, self.advice, self.values)

    def as_json(self) -> NoteJson:
        """Plain values."""
        return {
            "kind": self.kind.name.lower(),
            "severity": self.kind.severity,
            "trial": self.trial,
            "text": str(self),
            "advice": self.advice,
            "values": dict(self.values),
        }

    @classmethod
    def from_json(cls, stored: NoteJson) -> "Note":
        """The note of `as_json`.

        Raises:
            KeyError: it is none.
        """
        kind = Kind[stored["kind"].upper()]
        return cls._whole(kind, stored["text"], stored["trial"], stored["advice"], stored["values"])


def noted(kind: Kind, *texts: str) -> tuple[Note, ...]:
    """Sentences of one kind, as notes."""
    return tuple(Note(kind, text) for text in texts)
