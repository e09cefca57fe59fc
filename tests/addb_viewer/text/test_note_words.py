"""Notes by kind: what needs a decision first, and marker trouble in one line."""

from addb_viewer.text.note_words import by_kind
from solver.common.notes import Kind, Note, noted


def stray(trial, cm):
    marker = f"M{cm}"
    text = f"marker {marker} is up to {cm} cm off in frames 3-9: slipped, swapped or mislabelled?"
    return Note(Kind.FAR_MARKERS, text, trial=trial, values={"marker": marker, "cm": cm})


def test_twenty_markers_that_stray_are_one_line_the_farthest_first():
    far = Note(Kind.FAR_MARKERS, "marker M8 is far off", values={"marker": "M8", "cm": 31})
    (found,) = by_kind([*(stray("run", cm) for cm in range(5, 25)), far])
    assert found.needs_decision
    assert found.key_findings.startswith("markers far from the model (21): M8 31 cm, M24 24 cm, M23 23 cm, ")
    assert found.key_findings.count("slipped, swapped or mislabelled?") == 1


def test_what_needs_a_decision_comes_first_and_harm_says_in_which_order():
    notes = (
        *noted(Kind.PERSON, "height not given; 1.73 ± 0.05 m from the scaled model's legs"),
        stray("walk", 9),
        *noted(Kind.OTHER, "something else"),
        Note(Kind.NOT_READ, "left out, jump.trc cannot be used: line 7: a number is missing", trial="jump"),
    )
    found = by_kind(notes)
    assert [note for of_kind in found for note in of_kind.notes] == [notes[3], notes[1], notes[2], notes[0]]
    assert [of_kind.needs_decision for of_kind in found] == [True, True, True, False]


def test_a_note_is_told_once():
    assert [found.heading for found in by_kind(noted(Kind.PERSON, *["sex not given"] * 3))] == ["the person"]
