"""Which of the named causes become an extension, with the search itself put aside."""

from dataclasses import replace

import pytest

from solver.common.errors import FitError
from solver.diagnosis import accepting
from solver.diagnosis.causes.effect import Range
from solver.diagnosis.causes.plate_readings import PlateGain
from solver.diagnosis.marker_causes import NOTHING_SEEN
from solver.diagnosis.search.contenders import Contender
from solver.diagnosis.search.selection import CorrectedCause, Selection
from solver.fitting.settings import Settings

FLAGGED = slice(20, 40)  # frames
ONE, OTHER = ("plate_gain", "plate_1"), ("plate_gain", "plate_2")


@pytest.fixture
def found(monkeypatch, short_scene, balance_of_scenes):
    """Runs `extension_for` on causes, of which some are found again and others are undone on reading."""
    counts = short_scene.counts.copy()
    counts[FLAGGED] = False
    balance = balance_of_scenes(replace(short_scene, counts=counts))

    def contender(target):
        solved = balance.solve([balance.term(PlateGain(target), ())])
        return Contender(solved.terms[0], solved, 20.0)

    def run(again, undone, wanted, frames=None):
        null = balance.solve([])
        solved = balance.solve([contender(t).term for t in again])
        selection = Selection(
            null, solved, (), corrected=tuple(CorrectedCause(contender(t), t) for t in undone)
        )
        monkeypatch.setattr(accepting, "repaired_balance", lambda *_, **__: (balance, NOTHING_SEEN, None))
        monkeypatch.setattr(accepting, "select", lambda *_: selection)
        subject = type("Subject", (), {"folder": "lab/S4"})
        return accepting.extension_for(subject, Settings(), dict.fromkeys(wanted, ()) | (frames or {}))

    return run


def test_what_reading_undoes_is_no_part_of_the_extension_and_not_lost(found):
    answer = found(["plate_1"], ["plate_2"], {ONE, OTHER})
    assert [(c.id, c.target) for c in answer.extension.causes] == [ONE]
    assert answer.undone == (OTHER,)
    (cause,) = answer.causes_at(answer.extension.x + 0.01)
    assert cause.parameters["gain_error"][0] != answer.extension.causes[0].parameters["gain_error"][0]


def test_where_reading_undoes_all_nothing_is_to_be_accepted(found):
    with pytest.raises(FitError, match=r"lab/S4: nothing to accept: every fit corrects"):
        found([], ["plate_2"], {OTHER})


def test_a_cause_that_is_not_found_again_is_named(found):
    with pytest.raises(FitError, match=r"not found again: plate_gain \(plate_2\)"):
        found(["plate_1"], [], {ONE, OTHER})


def test_a_cause_whose_frames_are_flagged_since_is_settled_and_the_others_are_accepted(found, short_scene):
    there = Range(short_scene.name, FLAGGED.start + 2, FLAGGED.stop + 2)
    answer = found(["plate_1"], [], {ONE}, {OTHER: (there,)})
    assert [(c.id, c.target) for c in answer.extension.causes] == [ONE]
    assert answer.flagged == (OTHER,)
    with pytest.raises(FitError, match=r"leaves out the frames of plate_gain \(plate_2\)"):
        found([], [], (), {OTHER: (there,)})
    elsewhere = Range(short_scene.name, FLAGGED.stop, FLAGGED.stop + 20)
    with pytest.raises(FitError, match="not found again"):
        found(["plate_1"], [], {ONE}, {OTHER: (elsewhere,)})
