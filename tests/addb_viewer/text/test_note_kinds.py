"""Notes by kind: what needs a decision first, and marker trouble in one line."""

from itertools import chain
from pathlib import Path

import pytest

from addb_viewer.text.note_kinds import KINDS, OTHER, by_kind

HOUSE = Path(__file__).parents[3]
SOURCE = "".join(
    file.read_text(encoding="utf-8")
    for file in chain(
        (HOUSE / "solver").rglob("*.py"),
        (HOUSE / "annotations").glob("*.py"),
        (HOUSE / "addb_viewer" / "jobs").glob("accepted_*.py"),
        (HOUSE / "addb_viewer" / "jobs").glob("*review*.py"),
        (HOUSE / "addb_viewer" / "app" / "subjects").glob("library.py"),
    )
)


@pytest.mark.parametrize("phrase", [phrase for kind in KINDS for phrase in kind.phrases])
def test_a_phrase_is_one_that_notes_are_made_of(phrase):
    assert phrase in SOURCE


def test_twenty_markers_that_stray_are_one_line_the_farthest_first():
    notes = [
        f"run: marker M{cm} is up to {cm} cm off in frames 3-9: slipped, swapped or mislabelled?"
        for cm in range(5, 25)
    ]
    (found,) = by_kind([*notes, notes[3].replace("run", "walk").replace("8 cm", "31 cm")])
    assert found.kind.decide
    assert found.key_findings.startswith("markers far from the model (21): M8 31 cm, M24 24 cm, M23 23 cm, ")
    assert found.key_findings.count("slipped, swapped or mislabelled?") == 1


def test_what_needs_a_decision_comes_first_and_harm_says_in_which_order():
    notes = (
        "height not given; 1.73 ± 0.05 m from the scaled model's legs",
        "walk: marker A is up to 9 cm off in frames 0-3: slipped, swapped or mislabelled?",
        "something that no kind knows",
        "jump: left out, jump.trc cannot be used: line 7: a number is missing",
    )
    found = by_kind(notes)
    assert [note for of_kind in found for note in of_kind.notes] == [notes[3], notes[1], notes[2], notes[0]]
    assert [of_kind.kind.decide for of_kind in found] == [True, True, True, False]
    assert found[2].kind is OTHER


def test_a_note_is_told_once():
    assert [found.heading for found in by_kind(["sex not given"] * 3)] == ["the person"]
