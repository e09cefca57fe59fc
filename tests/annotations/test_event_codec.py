import json
from typing import get_args

import pytest

from annotations.event_codec import KINDS, decoded, encoded
from annotations.events import (
    AcceptProposal,
    ClearActivity,
    ClearRange,
    Event,
    FlagRange,
    ImportLabels,
    ImportTable,
    Proposal,
    Redo,
    RefuseActivity,
    RejectProposal,
    SetActivity,
    SetStatus,
    Status,
    Undo,
)
from annotations.review_errors import ReviewError

PROPOSAL = Proposal(3, 9, "missingBlip", "calcn_l", 0.8, {"gap_N": 120.5}, "addb-viewer 0.1.0")
EVENTS = (
    FlagRange(120, 180, "notOverForcePlate", "calcn_r", "foot beside the plate"),
    ClearRange(0, 1, note="à vérifier"),
    AcceptProposal(PROPOSAL),
    RejectProposal(PROPOSAL),
    SetActivity(0, 200, "run", "treadmill", "speeds up"),
    ClearActivity(0, 200),
    RefuseActivity(0, 200, "walk", "treadmill"),
    SetStatus(Status.SECOND_LOOK, "who stood on plate 2?"),
    SetStatus(Status.FINISHED, left_out=(PROPOSAL,)),
    ImportLabels(((0, 61), (175, 238)), 238, True),
    ImportLabels(((0, 61),), 238, True, ((61, 70),)),
    ImportTable(
        "S04.csv",
        "ben",
        (FlagRange(1, 2, "missingBlip", "calcn_l"), ClearRange(2, 3)),
        (SetActivity(0, 9, "squat"),),
        Status.FINISHED,
        "by ben",
    ),
    ImportTable("S05.csv", "ben", ()),
    Undo(7),
    Redo(7),
)


def test_every_event_is_tried_here_and_has_a_kind():
    assert {type(event) for event in EVENTS} == set(get_args(Event)) == set(KINDS.values())


@pytest.mark.parametrize("event", EVENTS, ids=lambda event: type(event).__name__)
def test_an_event_comes_back_from_json_as_it_went(event):
    kind, content = encoded(event)
    assert decoded(kind, json.loads(json.dumps(content))) == event


def test_the_form_on_disk_is_fixed():
    assert encoded(EVENTS[0]) == (
        "flag",
        {"start": 120, "end": 180, "reason": "notOverForcePlate", "foot": "calcn_r", "note": EVENTS[0].note},
    )


@pytest.mark.parametrize("make", [FlagRange, Proposal])
@pytest.mark.parametrize(("start", "end"), [(5, 5), (6, 5), (-1, 5)])
def test_a_range_without_frames_is_refused(make, start, end):
    with pytest.raises(ReviewError, match=f"no frames in {start}:{end}"):
        make(start, end, "manualReview")
