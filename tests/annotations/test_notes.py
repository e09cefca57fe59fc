"""What the second of two people at the same frames is told, and the first as well."""

import threading

import pytest

from annotations.events import (
    AcceptProposal,
    ClearRange,
    FlagRange,
    ImportLabels,
    Proposal,
    SetActivity,
    SetStatus,
    Status,
    Undo,
)
from annotations.folding import folded
from annotations.live_review import LiveReview
from annotations.log import ReviewLog
from annotations.notes import notes_for

FEET = ("calcn_r", "calcn_l")
RIGHT, LEFT = FEET
CONFLICT = (
    "frames 15 to 19, calcn_r: anna says 'notOverForcePlate' (edit 1), ben says 'notMissingGRF' (edit 2); "
    "the later one, ben's, counts"
)


def told(edits, reader, seen=0):
    return notes_for(reader, edits[seen:], folded("walk", edits, FEET))


def test_both_are_told_who_overruled_whom(edits):
    said = edits(("anna", FlagRange(10, 20, "notOverForcePlate", RIGHT)), ("ben", ClearRange(15, 30)))
    assert told(said, "ben", 1) == (CONFLICT,)
    assert told(said, "anna", 1) == (CONFLICT,)
    assert told(said, "cleo", 1) == ()


def test_what_was_told_once_is_not_told_again(edits):
    said = edits(
        ("anna", FlagRange(10, 20, "notOverForcePlate", RIGHT)),
        ("ben", ClearRange(15, 30)),
        ("anna", FlagRange(40, 50, "manualReview")),
    )
    assert told(said, "anna", 2) == ()


def test_who_says_the_same_at_once_hears_of_the_other(edits):
    flag = FlagRange(10, 20, "manualReview")
    said = edits(("anna", flag), ("ben", flag))
    assert told(said, "ben") == (
        "at the same frames as you: edit 1 by anna: frames 10 to 19, all feet: the force does not count, "
        "other",
    )
    assert told(said, "anna") == (
        "at the same frames as you: edit 2 by ben: frames 10 to 19, all feet: the force does not count, "
        "other",
    )


@pytest.mark.parametrize(
    "others",
    [
        FlagRange(20, 30, "manualReview"),
        FlagRange(10, 20, "manualReview", LEFT),
        SetActivity(10, 20, "walk"),
        SetStatus(Status.FINISHED),
    ],
)
def test_other_frames_feet_and_matters_are_nobodys_business(edits, others):
    said = edits(("anna", others), ("ben", FlagRange(10, 20, "manualReview", RIGHT)))
    assert told(said, "ben") == ()


def test_an_accepted_proposal_is_an_edit_like_others_and_an_import_is_not(edits):
    said = edits(
        ("anna", AcceptProposal(Proposal(0, 9, "missingBlip"))),
        ("imported", ImportLabels(((0, 9),), 9, True)),
        ("ben", FlagRange(0, 9, "missingBlip")),
    )
    (note,) = told(said, "ben")
    assert (
        "anna: frames 0 to 8, all feet: the proposal 'short gap in the force', > 99 % sure, accepted" in note
    )


def test_an_edit_that_was_taken_back_is_no_conflict(edits):
    said = edits(
        ("anna", FlagRange(10, 20, "notOverForcePlate", RIGHT)), ("ben", ClearRange(15, 30)), ("ben", Undo(2))
    )
    assert told(said, "anna", 2) == ()


def test_two_clients_at_the_same_range_at_once(place):
    """Both edits are in the log, both clients see the same state, and the second one has a note."""
    with ReviewLog.open(place) as one, ReviewLog.open(place) as other:
        clients = {"anna": LiveReview(one, FEET), "ben": LiveReview(other, FEET)}
        says = {"anna": FlagRange(10, 20, "notOverForcePlate"), "ben": FlagRange(12, 25, "zeroForceFrame")}
        shown = {who: live.revision for who, live in clients.items()}
        start, numbers = threading.Barrier(2), {}

        def edit(who):
            start.wait()
            numbers[who] = clients[who].log.append("walk", says[who], who)

        threads = [threading.Thread(target=edit, args=(who,)) for who in clients]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for live in clients.values():
            live.refresh()
        assert {edit.author: edit.event for edit in one.history()} == says
        states = [live.review("walk") for live in clients.values()]
        assert states[0] == states[1]
        second = max(numbers, key=lambda who: numbers[who])
        assert {flag.author for flag in states[0].flags if flag.start < 20 and flag.end > 12} == {second}
        for who, live in clients.items():
            (note,) = notes_for(who, live.since(shown[who], "walk"), live.review("walk"))
            assert note.startswith("frames 12 to 19: ")
            assert note.endswith(f"the later one, {second}'s, counts")
