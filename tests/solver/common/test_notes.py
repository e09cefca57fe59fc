"""Notes: sentences that know their kind, and stay what they were."""

import pickle

import pytest

from solver.common.notes import Kind, Note

ABOUT_MASS = Note(
    Kind.ENTERED_MASS, "the forces carry 61 kg", trial="walk", advice="check it", values={"kg": 61.0}
)


def test_a_note_reads_as_its_sentence_with_and_without_advice():
    assert ABOUT_MASS == "walk: the forces carry 61 kg; check it"
    assert ABOUT_MASS.without_advice == "walk: the forces carry 61 kg"


@pytest.mark.parametrize(
    "copied", [lambda n: Note.from_json(n.as_json()), lambda n: pickle.loads(pickle.dumps(n))]
)
def test_a_note_comes_back_whole(copied):
    again = copied(ABOUT_MASS)
    assert (again, vars(again)) == (ABOUT_MASS, vars(ABOUT_MASS))


def test_a_trial_and_a_place_are_named_once():
    note = Note(Kind.OTHER, "run.trc: a remark")
    assert note.of("run.trc") == note
    assert note.in_trial("run") == "run: run.trc: a remark" == note.in_trial("run").in_trial("run")
    assert note.in_trial("run").trial == "run"


def test_a_note_cannot_be_changed():
    with pytest.raises(AttributeError, match="does not change"):
        ABOUT_MASS.trial = "run"


def test_a_sentence_that_lost_its_names_does_not_get_them_back():
    without = ABOUT_MASS.reworded(lambda text: text.replace("walk", "trial 1").replace("check it", "look"))
    for copied in (without, Note.from_json(without.as_json()), pickle.loads(pickle.dumps(without))):
        assert copied == "trial 1: the forces carry 61 kg; look"
