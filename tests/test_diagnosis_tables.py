"""Tables of docs/diagnosis.md that are made from the code; a failing test prints what has to stand there."""

from pathlib import Path

from solver.diagnosis.decisions import CHECKS

PAGE = Path(__file__).parents[1] / "docs" / "diagnosis.md"
ASKED_OF = {
    "Withheld": "a cause that is added, exchanged or paired",
    "Added": "a cause that is added",
    "Kept": "a cause, once later ones are there",
    "OnReading": "a cause that reading undid",
    "BesideUnknown": "a named cause beside an unknown force",
    "AllInPlace": "all named causes together",
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
