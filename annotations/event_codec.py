"""Events as a kind and plain JSON, the form in which a database keeps them for good."""

from collections.abc import Callable, Mapping
from dataclasses import MISSING, asdict, fields, is_dataclass
from enum import StrEnum
from functools import cache
from types import NoneType, UnionType
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from annotations.events import (
    AcceptProposal,
    ClearActivity,
    ClearRange,
    FlagRange,
    ImportLabels,
    ImportTable,
    Redo,
    RefuseActivity,
    RejectProposal,
    SetActivity,
    SetStatus,
    Undo,
)
from annotations.reading import is_text
from annotations.review_errors import ReviewError

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
MOST = 10_000_000  # frames of three hours at 1000 Hz; more would fill the memory with masks

_T = TypeVar("_T")


class _WrongTypeError(Exception):
    """What a value should be."""


def encoded(event: object, kinds: Mapping[str, type[Any]] = KINDS) -> tuple[str, dict[str, Any]]:
    """An event's kind, and its fields as JSON has them.

    Args:
        event: of one of the kinds.
        kinds: of the log that keeps it.
    """
    return kind_of(type(event), kinds), asdict(event)  # type: ignore[call-overload]


def kind_of(event: type[Any], kinds: Mapping[str, type[Any]] = KINDS) -> str:
    """What rows of this type of event are called in the database."""
    return next(kind for kind, form in kinds.items() if form is event)


def decoded(kind: str, content: Mapping[str, Any], kinds: Mapping[str, type[_T]] = KINDS) -> _T:
    """The event that `encoded` was given.

    Raises:
        ReviewError: a kind, a field or a value that this version does not know, or a value of a wrong type;
            as a clause.
    """
    if kind not in kinds:
        raise ReviewError(f"it is of the kind {_short(kind)}, written by a newer version; update addb-viewer")
    if not isinstance(content, dict):
        raise ReviewError("its content is not a JSON object")
    return _made(kinds[kind], content)


def _made(form: type[_T], content: object) -> _T:
    """A dataclass of a log, its fields checked by their types."""
    written, types = _object(content), _types(form)  # type: ignore[arg-type]
    unknown = [name for name in written if name not in types]
    if unknown:
        raise ReviewError(
            f"it says {_short(unknown[0])}, which this version does not know: written by a newer version; "
            "update addb-viewer"
        )
    values = {}
    for name, value in written.items():
        try:
            values[name] = _value(types[name], value)
        except _WrongTypeError as error:
            raise ReviewError(f"its '{name}' is not {error}") from error
    try:
        return form(**values)
    except TypeError as error:
        lacking = [
            field.name
            for field in fields(form)  # type: ignore[arg-type]
            if field.name not in written and field.default is MISSING and field.default_factory is MISSING
        ]
        raise ReviewError(f"it does not say all of {', '.join(lacking)}; update addb-viewer") from error


@cache
def _types(form: type[Any]) -> dict[str, Any]:
    """The types of a dataclass' fields by name."""
    hints = get_type_hints(form)
    return {field.name: hints[field.name] for field in fields(form)}


def _value(hint: Any, value: object) -> Any:
    """A value of JSON as a field's type has it."""
    if isinstance(hint, UnionType):
        if value is None and NoneType in get_args(hint):
            return None
        kinds = [kind for kind in get_args(hint) if kind is not NoneType]
        hint = kinds[-1] if len(kinds) > 1 and "reason" not in _object(value) else kinds[0]  # flag, or clear
    inner = get_args(hint)
    if get_origin(hint) is tuple:
        return _tuple(inner, value)
    if get_origin(hint) is Mapping:
        return {_text(name): _value(inner[1], own) for name, own in _object(value).items()}
    if is_dataclass(hint):
        return _made(hint, value)  # type: ignore[arg-type]
    if issubclass(hint, StrEnum):
        return _word(hint, _text(value))
    return _PLAIN[hint](value)


def _tuple(kinds: tuple[Any, ...], value: object) -> tuple[Any, ...]:
    if not isinstance(value, list | tuple):
        raise _WrongTypeError("a list")
    kinds = kinds[:1] * len(value) if kinds[-1] is Ellipsis else kinds
    if len(kinds) != len(value):
        raise _WrongTypeError(f"a list of {len(kinds)}; update addb-viewer")
    return tuple(_value(kind, part) for kind, part in zip(kinds, value, strict=True))


def _object(value: object) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise _WrongTypeError("a JSON object")
    return value


def _word(form: type[StrEnum], word: str) -> StrEnum:
    if word not in list(form):
        raise _WrongTypeError(f"one that this version knows, but {_short(word)}; update addb-viewer")
    return form(word)


def _whole_number(value: object) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value <= MOST:
        raise _WrongTypeError(f"a whole number, 0 to {MOST}")
    return value


def _text(value: object) -> str:
    if not is_text(value):
        raise _WrongTypeError("a text")
    return value


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


_PLAIN: dict[Any, Callable[[object], object]] = {
    int: _whole_number,
    str: _text,
    float: _number,
    bool: _truth,
}


def _short(text: str) -> str:
    """A word of the log, in quotes; a long one cut."""
    return repr(text if len(text) <= 40 else f"{text[:40]}…")
