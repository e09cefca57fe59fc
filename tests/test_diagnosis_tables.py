"""Tables of docs/diagnosis.md that are made from the code; a failing test prints what has to stand there."""

import re
from pathlib import Path

import pytest

from solver.diagnosis.decisions import CHECKS
from solver.effects.about import Size
from solver.effects.catalogue import ABOUT

PAGE = Path(__file__).parents[1] / "docs" / "diagnosis.md"
ASKED_OF = {
    "Withheld": "a cause that is added, exchanged or paired",
    "Added": "a cause that is added",
    "Kept": "a cause, once later ones are there",
    "OnReading": "a cause that reading undid",
    "BesideUnknown": "a named cause beside an unknown force",
    "AllInPlace": "all named causes together",
    "AgainstAnything": "a named cause at the end",
    "Remainder": "an unknown force",
}


def between(name: str) -> str:
    """What the page holds of one table."""
    text = PAGE.read_text(encoding="utf-8")
    start = f"<!-- {name}: made by tests/{Path(__file__).name} -->\n"
    return text.split(start)[1].split(f"<!-- end of {name} -->")[0]


def test_the_checks_stand_in_their_order():
    rows = ["| check | question | asked of |", "|---|---|---|"]
    for check in CHECKS:
        asked = "; ".join(ASKED_OF[kind.__name__] for kind in check.asked_of)
        rows.append(f"| {check.name} | {check.question} | {asked} |")
    assert between("checks") == "\n".join(rows) + "\n"


def sizes_in_words(sizes: tuple[Size, ...]) -> str:
    return "; ".join(f"`{s.parameter}` {s.usual:g} / {s.rare:g} / {s.most:g}: {s.why}" for s in sizes)


def test_what_stands_beside_each_cause():
    rows = [
        "| id | branch | at fault | over time | odds | put right by | picture | sizes |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for one in ABOUT.values():
        picture = "label" if one.picture is None else type(one.picture).__name__.lower()
        cells = [
            f"`{one.id}`",
            one.branch,
            one.at_fault.value,
            one.course.value,
            f"{one.odds_against:g}",
            one.mend.value,
            picture,
            sizes_in_words(one.sizes),
        ]
        rows.append("| " + " | ".join(cells) + " |")
    assert between("causes") == "\n".join(rows) + "\n"


@pytest.mark.parametrize("one", ABOUT.values(), ids=lambda one: one.id)
def test_everything_is_said_of_each_cause(one):
    assert all((one.title, one.sentence, one.remedy, one.told_apart_by, one.branch))
    assert all(s.usual < s.rare < s.most and s.why for s in one.sizes)


@pytest.mark.parametrize("room", ["addb_viewer", "solver/diagnosis", "solver/diagnosis_settings.py"])
def test_nobody_else_asks_for_the_id_of_a_cause(room):
    place = Path(__file__).parents[1] / room
    files = [place] if place.is_file() else sorted(place.rglob("*.py"))
    assert files
    literal = re.compile("|".join(rf"[\"']{id}[\"']" for id in ABOUT))
    found = [f"{f.name}: {m[0]}" for f in files for m in literal.finditer(f.read_text(encoding="utf-8"))]
    assert found == []
