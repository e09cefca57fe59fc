"""docs/annotations.md lists every reason with its number and key, every activity, status and kind of edit."""

import re
from pathlib import Path

from annotations.activities import ACTIVITIES
from annotations.event_codec import KINDS
from annotations.events import Status
from annotations.reasons import REASONS, key_of, reason_words

PAGE = (Path(__file__).parents[2] / "docs" / "annotations.md").read_text(encoding="utf-8")


def rows(heading):
    """The cells of a section's table, without its head."""
    section = PAGE.split(f"\n## {heading}\n")[1].split("\n## ")[0]
    lines = [line for line in section.splitlines() if line.startswith("|")][2:]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def test_reasons_with_numbers_and_keys():
    expected = [[str(k), f"`{name}`", key_of(name), reason_words(name)] for k, name in enumerate(REASONS)]
    expected[0][2:] = ["0", "clears: the force counts"]
    assert rows("Reasons") == expected


def test_activities_with_subclasses():
    assert rows("Activities") == [[f"`{name}`", ", ".join(kinds)] for name, kinds in ACTIVITIES.items()]


def test_statuses():
    section = PAGE.split("\n## Status\n")[1]
    assert section.startswith("\n" + ", ".join(f"`{status}`" for status in Status))


def test_kinds_of_edits():
    told = [name for row in rows("A log of edits") for name in re.findall(r"`(.*?)`", row[0])]
    assert told == list(KINDS)
