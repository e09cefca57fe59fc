"""Events as a kind and plain JSON, the form in which a database keeps them for good."""

from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any

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
    RejectProposal,
    SetActivity,
    SetStatus,
    Status,
    Undo,
)

KINDS: dict[str, type[Any]] = {
    "flag": FlagRange,
    "clear": ClearRange,
    "accept proposal": AcceptProposal,
    "reject proposal": RejectProposal,
    "activity": SetActivity,
    "clear activity": ClearActivity,
    "status": SetStatus,
    "import": ImportLabels,
    "import table": ImportTable,
    "undo": Undo,
    "redo": Redo,
}
_KIND_OF = {event: kind for kind, event in KINDS.items()}

_BEFORE = {"status": {"left_out": ()}}
"""By kind, what edits mean that were written before there was such a field. People alone decided about the
forces of a trial that they had finished: nothing else stayed left out."""

_READ: dict[str, Callable[[Any], object]] = {
    "proposal": lambda content: Proposal(**content),
    "status": lambda status: None if status is None else Status(status),
    "left_out": lambda found: None if found is None else tuple(Proposal(**content) for content in found),
    "missing": lambda ranges: tuple((start, end) for start, end in ranges),
    "unreviewed": lambda ranges: tuple((start, end) for start, end in ranges),
    "ranges": lambda ranges: tuple(
        FlagRange(**content) if "reason" in content else ClearRange(**content) for content in ranges
    ),
    "activities": lambda ranges: tuple(SetActivity(**content) for content in ranges),
}  # by name of the field, where JSON has no such type


def encoded(event: Event) -> tuple[str, dict[str, Any]]:
    """An event's kind, and its fields as JSON has them."""
    return kind_of(type(event)), asdict(event)


def kind_of(event: type[Event]) -> str:
    """What edits of this type are called in the database."""
    return _KIND_OF[event]


def decoded(kind: str, content: Mapping[str, Any]) -> Event:
    """The event that `encoded` was given.

    Raises:
        ReviewError: a kind, a field or a value that this version does not know.
    """
    if kind not in KINDS:
        raise ReviewError(f"edits of the kind '{kind}' are unknown to this version; update addb-viewer")
    written = {**_BEFORE.get(kind, {}), **content}
    try:
        fields = {name: _READ.get(name, _as_it_is)(value) for name, value in written.items()}
        event: Event = KINDS[kind](**fields)
    except (TypeError, ValueError) as error:
        raise ReviewError(
            f"an edit of the kind '{kind}' says what this version does not know ({error}); update addb-viewer"
        ) from error
    return event


def _as_it_is(value: object) -> object:
    return value
