"""Typed values as plain ones and back."""

import json
from dataclasses import dataclass, field

import jsonschema
import numpy as np
import pytest

from solver.common.notes import Kind, Note
from solver.common.typed_json import from_plain, plain, schema_of


@dataclass(frozen=True)
class Part:
    size: float | None
    name: str = "part"


@dataclass(frozen=True)
class Whole:
    parts: tuple[Part, ...]
    by_name: dict[str, Part] = field(default_factory=dict)
    notes: tuple[Note, ...] = ()


WHOLE = Whole((Part(np.float64(1.5)), Part(None)), {"a": Part(2.0, "b")}, (Note(Kind.OTHER, "a note"),))


def test_values_come_back_through_strict_json_defaults_too():
    stored = json.loads(json.dumps(plain(WHOLE), allow_nan=False))
    again = from_plain(stored, Whole)
    assert again == WHOLE
    assert plain(again) == stored


def test_what_is_written_obeys_the_schema_and_other_things_do_not():
    schema = schema_of(Whole)
    jsonschema.validate(plain(WHOLE), schema)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate({"parts": [{"size": "large"}]}, schema)


def test_what_is_of_another_kind_is_named():
    with pytest.raises(ValueError, match=r"parts\[0\]\.size"):
        from_plain({"parts": [{"size": "large"}]}, Whole)
    for other in ("as an older version wrote it", {"kind": "other"}, {"kind": "none of ours"}):
        with pytest.raises(ValueError, match=r"no note of this version.*notes\[0\]"):
            from_plain(plain(WHOLE) | {"notes": [other]}, Whole)
