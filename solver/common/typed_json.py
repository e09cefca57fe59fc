"""Frozen dataclasses as plain values for JSON and back, and the JSON Schema of a type."""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import numpy as np

from solver.common.notes import Note, NoteJson

Typed = TypeVar("Typed")


def plain(value: object) -> Any:
    """Mappings, lists, numbers and texts of a typed value."""
    if isinstance(value, Note):
        return value.as_json()
    if isinstance(value, Path):
        return str(value)
    if is_dataclass(value):
        return {f.name: plain(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, tuple | list):
        return [plain(item) for item in value]
    return value.item() if isinstance(value, np.generic) else value


def from_plain(stored: Mapping[str, Any], kind: type[Typed]) -> Typed:
    """The typed value of plain ones.

    Raises:
        ValueError: something is missing, or of another kind; it says where.
    """
    return msgspec.convert(stored, kind, dec_hook=_made_of)


def schema_of(kind: type) -> dict[str, Any]:
    """JSON Schema (2020-12) of what `plain` makes of a type."""
    return msgspec.json.schema(kind, schema_hook=_schema_of)


def _made_of(kind: type, stored: Any) -> Any:
    if kind is Path and isinstance(stored, str):
        return Path(stored)
    if kind is Note:
        try:
            return Note.from_json(stored)
        except (AttributeError, KeyError, TypeError) as error:
            raise ValueError(f"no note of this version ({error})") from error
    raise NotImplementedError(f"no way to read a {kind.__name__}")


def _schema_of(kind: type) -> dict[str, Any]:
    if kind is Note:
        return {"type": "object", "required": sorted(NoteJson.__required_keys__)}
    raise NotImplementedError(f"no schema of a {kind.__name__}")
