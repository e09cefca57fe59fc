"""Events as a kind and plain JSON, the form in which a database keeps them for good."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import MISSING, asdict, fields
from typing import Any, TypeVar

from annotations.activities import ACTIVITIES
from annotations.errors import ReviewError
from annotations.events import (
    AcceptProposal,
    ClearActivity,
    ClearRange,
    Event,
    FlagRange,
    ImportLabels,
    ImportTable,
    Proposal,
    Redo,
    RefuseActivity,
    RejectProposal,
    SetActivity,
    SetStatus,
    Status,
    Undo,
)
from annotations.reasons import REASONS
from annotations.unreadable import is_text

KINDS: dict[str, type[Any]] = {
    "flag": FlagRange,
    "clear": ClearRange,
    "accept proposal": AcceptProposal,
    "reject proposal": RejectProposal,
    "activity": SetActivity,
    "clear activity": ClearActivity,
    "refuse activity": RefuseActivity,
    "status": SetStatus,
    "import": ImportLabels,
    "import table": ImportTable,
    "undo": Undo,
    "redo": Redo,
}
_KIND_OF = {event: kind for kind, event in KINDS.items()}

MOST_FRAMES = 10_000_000  # of a trial; three hours at 1000 Hz. More would fill the memory with masks

_T = TypeVar("_T")

_BEFORE = {"status": {"left_out": ()}}
"""By kind, what edits mean that were written before there was such a field. People alone decided about the
forces of a trial that they had finished: nothing else stayed left out."""


def encoded(event: Event) -> tuple[str, dict[str, Any]]:
    """An event's kind, and its fields as JSON has them."""
    return kind_of(type(event)), asdict(event)


def kind_of(event: type[Event]) -> str:
    """What edits of this type are called in the database."""
    return _KIND_OF[event]


def decoded(kind: str, content: Mapping[str, Any]) -> Event:
    """The event that `encoded` was given.

    Raises:
        ReviewError: a kind, a field or a value that this version does not know, or a value of a wrong type;
            as a clause.
    """
    if kind not in KINDS:
        raise ReviewError(f"it is of the kind {_short(kind)}, written by a newer version; update addb-viewer")
    if not isinstance(content, dict):
        raise ReviewError("its content is not a JSON object")
    event: Event = _made(KINDS[kind], {**_BEFORE.get(kind, {}), **content})
    if isinstance(event, SetStatus) and event.status is None:
        raise ReviewError("its 'status' is not text")
    if isinstance(event, ImportLabels) and any(
        not start < end <= event.frames for start, end in (*event.missing, *event.unreviewed)
    ):
        raise ReviewError(f"it labels frames that are not among its {event.frames}")
    return event


def _made(form: type[_T], content: object) -> _T:
    """One of the dataclasses of `annotations.events`, its fields checked."""
    written, known = _object(content), {field.name: field for field in fields(form)}  # type: ignore[arg-type]
    unknown = [name for name in written if name not in known]
    if unknown:
        raise ReviewError(
            f"it says {_short(unknown[0])}, which this version does not know: written by a newer version; "
            "update addb-viewer"
        )
    values = {}
    for name, value in written.items():
        try:
            values[name] = _READ[name](value)
        except _WrongTypeError as error:
            raise ReviewError(f"its '{name}' is not {error}") from error
    try:
        return form(**values)
    except TypeError as error:
        lacking = [
            name
            for name, field in known.items()
            if name not in written and field.default is MISSING and field.default_factory is MISSING
        ]
        raise ReviewError(f"it does not say all of {', '.join(lacking)}; update addb-viewer") from error


class _WrongTypeError(Exception):
    """What a value should be."""


def _object(value: object) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise _WrongTypeError("a JSON object")
    return value


def _frame(value: object) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value <= MOST_FRAMES:
        raise _WrongTypeError(f"a number of a frame, 0 to {MOST_FRAMES}")
    return value


def _edit_number(value: object) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or value < 1:
        raise _WrongTypeError("the number of an edit")
    return value


def _text(value: object) -> str:
    if not is_text(value):
        raise _WrongTypeError("a text")
    return value


def _text_or_none(value: object) -> str | None:
    return None if value is None else _text(value)


def _number(value: object) -> float:
    if not isinstance(value, int | float) or isinstance(value, bool):
        raise _WrongTypeError("a number")
    try:
        float(value)
    except OverflowError as error:
        raise _WrongTypeError("a number that can be computed with") from error
    return value


def _truth(value: object) -> bool:
    if not isinstance(value, bool):
        raise _WrongTypeError("true or false")
    return value


def _list(value: object) -> Sequence[Any]:
    if not isinstance(value, list | tuple):
        raise _WrongTypeError("a list")
    return value


def _frames(value: object) -> tuple[int, int]:
    pair = _list(value)
    if len(pair) != 2:
        raise _WrongTypeError("a list of first and last frames; update addb-viewer")
    return _frame(pair[0]), _frame(pair[1])


def _one_of(known: Collection[str], value: object) -> str:
    word = _text(value)
    if word not in known:
        raise _WrongTypeError(f"one that this version knows, but {_short(word)}; update addb-viewer")
    return word


def _evidence(value: object) -> dict[str, float]:
    return {_text(name): _number(figure) for name, figure in _object(value).items()}


def _label(value: object) -> FlagRange | ClearRange:
    content = _object(value)
    return _made(FlagRange, content) if "reason" in content else _made(ClearRange, content)


def _short(text: str) -> str:
    """A word of the log, in quotes; a long one cut."""
    return repr(text if len(text) <= 40 else f"{text[:40]}…")


_READ: dict[str, Callable[[Any], object]] = {
    "start": _frame,
    "end": _frame,
    "frames": _frame,
    "edit": _edit_number,
    "reason": lambda word: _one_of(REASONS, word),
    "foot": _text_or_none,
    "note": _text,
    "confidence": _number,
    "evidence": _evidence,
    "detector": _text,
    "proposal": lambda content: _made(Proposal, content),
    "activity": lambda word: _one_of(ACTIVITIES, word),
    "subclass": _text_or_none,
    "status": lambda word: None if word is None else Status(_one_of(list(Status), word)),
    "status_note": _text,
    "left_out": lambda found: None if found is None else tuple(_made(Proposal, one) for one in _list(found)),
    "missing": lambda ranges: tuple(_frames(pair) for pair in _list(ranges)),
    "unreviewed": lambda ranges: tuple(_frames(pair) for pair in _list(ranges)),
    "finished": _truth,
    "file": _text,
    "by": _text,
    "ranges": lambda ranges: tuple(_label(content) for content in _list(ranges)),
    "activities": lambda ranges: tuple(_made(SetActivity, content) for content in _list(ranges)),
}  # by name of the field
