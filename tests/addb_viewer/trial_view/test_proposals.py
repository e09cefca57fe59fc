from dataclasses import replace
from datetime import UTC, datetime

from addb_viewer.trial_view.proposals import State, as_proposed, pending, still_open
from annotations.events import AcceptProposal, ClearRange, Edit, FlagRange, Proposal, RejectProposal
from annotations.folding import folded
from solver.contact.detected_ranges import Proposal as Detected

FEET = ("calcn_r", "calcn_l")
FOUND = (
    Detected((50, 60), "calcn_l", "forceDiscrepancy", 0.9),
    Detected((10, 20), "calcn_r", "notOverForcePlate", 0.6),
    Detected((30, 40), None, "hasInputOutliers", 0.2),
)


def states(*events):
    edits = [Edit(i + 1, "walk", "Zoë", datetime.now(UTC), event) for i, event in enumerate(events)]
    return [p.state for p in pending(FOUND, folded("walk", edits, FEET), {})]


def test_they_come_in_order_of_time_and_are_open_at_first():
    proposals = pending(FOUND, folded("walk", [], FEET), {})
    assert [p.proposal.start for p in proposals] == [10, 30, 50]
    assert still_open(proposals) == 3
    assert still_open(proposals, 0.5) == 2


def test_decisions_close_them_also_those_made_by_hand():
    accepted = AcceptProposal(Proposal(10, 20, "notOverForcePlate", "calcn_r"))
    rejected = RejectProposal(Proposal(30, 40, "hasInputOutliers"))
    assert states(accepted, rejected) == [State.ACCEPTED, State.REJECTED, State.OPEN]
    by_hand = (FlagRange(45, 70, "manualReview", "calcn_l"), ClearRange(0, 25, "calcn_r"))
    assert states(*by_hand) == [State.REJECTED, State.OPEN, State.ACCEPTED]


def test_the_last_word_counts():
    p = Proposal(10, 20, "notOverForcePlate", "calcn_r")
    assert states(RejectProposal(p), AcceptProposal(p))[0] is State.ACCEPTED
    assert states(AcceptProposal(p), ClearRange(10, 20, "calcn_r"))[0] is State.REJECTED


def test_a_flag_of_the_other_foot_or_of_a_part_decides_nothing():
    assert states(FlagRange(10, 20, "manualReview", "calcn_l"))[0] is State.OPEN
    assert states(FlagRange(10, 15, "manualReview", "calcn_r"))[0] is State.OPEN


def test_frames_of_a_cause_accept_what_is_proposed_there_and_flag_the_rest():
    proposals = pending(FOUND, folded("walk", [], FEET), {})
    right = proposals[0].proposal
    inside = FlagRange(9, 18, "notOverForcePlate", "calcn_r")
    assert as_proposed(inside, proposals) == [AcceptProposal(right), replace(inside, end=10)]
    aside = FlagRange(0, 14, "notOverForcePlate", "calcn_r")
    assert as_proposed(aside, proposals) == [aside], "the proposal is mostly about others"
    assert as_proposed(replace(inside, foot="calcn_l"), proposals) == [replace(inside, foot="calcn_l")]
    again = pending(
        FOUND, folded("walk", [Edit(1, "walk", "Zoë", datetime.now(UTC), AcceptProposal(right))], FEET), {}
    )
    assert as_proposed(inside, again) == [inside]
