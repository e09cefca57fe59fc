from datetime import UTC, datetime

import pytest

from annotations.events import (
    AcceptProposal,
    ClearActivity,
    ClearRange,
    Edit,
    FlagRange,
    ImportLabels,
    ImportTable,
    Proposal,
    Redo,
    RejectProposal,
    SetActivity,
    SetStatus,
    Status,
    Undo,
)
from annotations.wording import said

PROPOSAL = Proposal(3, 9, "missingBlip", "calcn_l", 0.8, {}, "addb-viewer 0.1.0")


@pytest.mark.parametrize(
    ("event", "line"),
    [
        (
            FlagRange(0, 5, "zeroForceFrame", "calcn_r", "see video"),
            "frames 0 to 4, right foot: the force does not count, force is zero (see video)",
        ),
        (ClearRange(0, 5), "frames 0 to 4, all feet: the force counts"),
        (
            AcceptProposal(PROPOSAL),
            "frames 3 to 8, left foot: the proposal 'short gap in the force', 80 % sure, accepted",
        ),
        (
            RejectProposal(Proposal(3, 9, "missingBlip")),
            "frames 3 to 8, all feet: the proposal 'short gap in the force', > 99 % sure, rejected",
        ),
        (SetActivity(0, 200, "run", "treadmill", "3 m/s"), "frames 0 to 199: run treadmill (3 m/s)"),
        (SetActivity(0, 9, "jump", "drop jump"), "frames 0 to 8: drop jump"),
        (ClearActivity(0, 200), "frames 0 to 199: activity removed"),
        (SetStatus(Status.SECOND_LOOK, "plate 2?"), "needs a second look (plate 2?)"),
        (ImportLabels(((0, 61), (175, 238)), 238, True), "review.json imported, 124 frames without force"),
        (
            ImportTable("S04.csv", "ben", (ClearRange(2, 3),), (SetActivity(0, 9, "squat"),)),
            "S04.csv imported by ben, 2 ranges",
        ),
        (Undo(7), "edit 7 undone"),
        (Redo(7), "edit 7 counts again"),
    ],
)
def test_every_kind_of_edit_is_a_sentence(event, line):
    assert said(Edit(12, "walk", "anna", datetime.now(UTC), event)) == f"edit 12 by anna: {line}"
