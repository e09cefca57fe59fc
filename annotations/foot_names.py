"""How people call feet, which files call by their bodies."""

import re
from collections.abc import Sequence

_SIDES = {"r": {"r", "right"}, "l": {"l", "left"}}
_WORDS = re.compile(r"[A-Z]?[a-z]+|[A-Z]+")  # of a body's name: calcn_r, footR, RightFoot


def side_of(body: str) -> str | None:
    """Side of a foot's body by the words of its name: "r" or "l"; None where they do not tell."""
    words = {word.lower() for word in _WORDS.findall(body)}
    found = [side for side, names in _SIDES.items() if names & words]
    return found[0] if len(found) == 1 else None


def foot_letter(foot: str) -> str:
    """R or L where the body's name says so, else the name."""
    side = _side(foot)
    return {"right": "R", "left": "L"}.get(side, foot)


def foot_words(foot: str | None) -> str:
    """Right, left, the body's name, or both."""
    return "both" if foot is None else (_side(foot) or foot)


def foot_named(foot: str | None) -> str:
    """A foot within a sentence: right foot, left foot, the body's name, or all feet."""
    side = "" if foot is None else _side(foot)
    return "all feet" if foot is None else f"{side} foot" if side else foot


def next_foot(foot: str | None, feet: Sequence[str]) -> str | None:
    """Through right, left, and both (None), in this order."""
    order: list[str | None] = [*sorted(feet, key=lambda name: _side(name) != "right"), None]
    return order[(order.index(foot) + 1) % len(order)] if foot in order else None


def _side(foot: str) -> str:
    name = foot.lower()
    for letter, word in (("r", "right"), ("l", "left")):
        if name.endswith((f"_{letter}", word)) or name.startswith((f"{letter}_", word)):
            return word
    return ""
