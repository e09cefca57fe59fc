"""How a stage declares a setting: its default, its unit, and the reason for that value beside it."""

from dataclasses import field
from typing import TypeVar

Value = TypeVar("Value")


def setting(default: Value, unit: str, why: str) -> Value:
    """A field of a stage's frozen Settings dataclass; `addb-viewer settings` prints `unit` and `why`.

    Args:
        default: the value used when nobody says otherwise.
        unit: of the value, as in "Hz" or "m"; "" for one without.
        why: the reason for the default, with its source where there is one.
    """
    described: Value = field(default=default, metadata={"unit": unit, "why": why})
    return described
