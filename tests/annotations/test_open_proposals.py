"""A detector proposes; what a person has said stays as it is and is not asked again."""

import pytest

from annotations.events import (
    AcceptProposal,
    ClearRange,
    FlagRange,
    ImportLabels,
    Proposal,
    RejectProposal,
    SetActivity,
    Undo,
)
from annotations.folding import folded
from annotations.open_proposals import open_proposals

FEET = ("calcn_r", "calcn_l")
RIGHT, LEFT = FEET
FOUND = Proposal(10, 20, "missingBlip", RIGHT, 0.8)


@pytest.mark.parametrize(
    ("said", "is_open"),
    [
        ((), True),
        ((("anna", AcceptProposal(FOUND)),), False),
        ((("anna", RejectProposal(FOUND)),), False),
        ((("anna", AcceptProposal(FOUND)), ("anna", Undo(1))), True),
        ((("anna", AcceptProposal(Proposal(12, 21, "missingBlip", RIGHT, 0.6))),), False),  # placed anew
        # Its first frames would be left out though somebody said that the finding is wrong: asked again.
        ((("anna", RejectProposal(Proposal(12, 21, "missingBlip", RIGHT, 0.6))),), True),
        ((("anna", RejectProposal(Proposal(17, 40, "missingBlip", RIGHT))),), True),  # another finding
        ((("anna", RejectProposal(Proposal(10, 20, "missingBlip", LEFT))),), True),
        ((("anna", FlagRange(0, 40, "forceDiscrepancy")),), False),
        ((("anna", FlagRange(0, 40, "forceDiscrepancy", LEFT)),), True),
        ((("anna", FlagRange(0, 15, "forceDiscrepancy")),), True),
        ((("anna", FlagRange(0, 15, "forceDiscrepancy")), ("ben", ClearRange(15, 40, RIGHT))), False),
        ((("imported", ImportLabels(((0, 40),), 40, True)),), False),  # left out already
        ((("imported", ImportLabels(((0, 15),), 40, True)),), True),
        ((("anna", SetActivity(0, 40, "walk")),), True),
    ],
)
def test_what_waits_for_a_person(edits, said, is_open):
    review = folded("walk", edits(*said), FEET)
    assert open_proposals([FOUND], review) == ((FOUND,) if is_open else ())


def test_a_proposal_for_all_feet_waits_until_every_foot_is_decided(edits):
    both = Proposal(10, 20, "missingBlip")
    said = [("anna", ClearRange(0, 40, RIGHT)), ("anna", ClearRange(0, 40, LEFT))]
    assert open_proposals([both], folded("walk", edits(*said[:1]), FEET)) == (both,)
    assert open_proposals([both], folded("walk", edits(*said), FEET)) == ()


def test_proposals_that_nobody_has_accepted_change_nothing(edits):
    flagged = ("anna", FlagRange(0, 15, "forceDiscrepancy", RIGHT, "seen on video"))
    before = folded("walk", edits(flagged), FEET)
    assert len(open_proposals([FOUND, Proposal(0, 40, "zeroForceFrame")], before)) == 2
    assert folded("walk", edits(flagged), FEET) == before
    assert folded("walk", edits(flagged, ("ben", RejectProposal(FOUND))), FEET).flags == before.flags
