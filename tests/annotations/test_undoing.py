import pytest

from annotations.events import ClearRange, ImportLabels, Redo, Undo
from annotations.review_errors import ReviewError
from annotations.undoing import in_force, next_redo, next_undo, undo_of

EDIT = ClearRange(0, 1)
IMPORT = ImportLabels((), 1, False)


def numbers(found):
    return [edit.number for edit in found]


def test_an_undone_edit_does_not_count_until_it_is_redone(edits):
    said = [("anna", EDIT), ("anna", EDIT), ("anna", Undo(1))]
    assert numbers(in_force(edits(*said))) == [2]
    assert numbers(in_force(edits(*said, ("anna", Redo(1))))) == [1, 2]
    assert numbers(in_force(edits(*said, ("anna", Redo(1)), ("anna", Undo(1))))) == [2]


def test_undo_goes_back_step_by_step_through_ones_own_edits(edits):
    said = [("anna", EDIT), ("ben", EDIT), ("anna", EDIT)]
    assert next_undo(edits(*said), "anna").number == 3
    said.append(("anna", Undo(3)))
    assert next_undo(edits(*said), "anna").number == 1
    said.append(("anna", Undo(1)))
    with pytest.raises(ReviewError, match="nothing of anna's to undo"):
        next_undo(edits(*said), "anna")
    assert next_undo(edits(*said), "ben").number == 2


def test_redo_comes_back_in_the_opposite_order(edits):
    said = [("anna", EDIT), ("anna", EDIT), ("anna", Undo(2)), ("anna", Undo(1))]
    assert next_redo(edits(*said), "anna").number == 1
    said.append(("anna", Redo(1)))
    assert next_redo(edits(*said), "anna").number == 2
    assert next_undo(edits(*said), "anna").number == 1


def test_a_new_edit_leaves_nothing_to_redo_but_another_persons_does_not_matter(edits):
    said = [("anna", EDIT), ("anna", Undo(1)), ("ben", EDIT)]
    assert next_redo(edits(*said), "anna").number == 1
    with pytest.raises(ReviewError, match="nothing of anna's to redo"):
        next_redo(edits(*said, ("anna", EDIT)), "anna")


def test_an_edit_is_undone_by_its_number_by_its_author_and_an_import_by_anybody(edits):
    said = edits(("anna", EDIT), ("imported", IMPORT), ("anna", EDIT))
    assert undo_of(said, 1, "anna").number == 1
    assert undo_of(said, 2, "ben").number == 2
    with pytest.raises(ReviewError, match="edit 3 is anna's, not ben's; flag or clear"):
        undo_of(said, 3, "ben")


def test_what_is_not_there_or_undone_already_cannot_be_undone(edits):
    said = edits(("anna", EDIT), ("anna", Undo(1)))
    with pytest.raises(ReviewError, match="edit 9 is not one of this trial's"):
        undo_of(said, 9, "anna")
    for number in (1, 2):
        with pytest.raises(ReviewError, match=f"edit {number} is undone already, or is itself"):
            undo_of(said, number, "anna")
