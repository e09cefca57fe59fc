from dataclasses import replace
from datetime import UTC, datetime

import pytest

from addb_viewer.app.review.review_html import history_html, proposals_html, ranges_html
from addb_viewer.report.timeline import lanes_html
from addb_viewer.trial_view.lanes import lanes_of
from addb_viewer.trial_view.proposals import pending
from addb_viewer.trial_view.span import Span
from addb_viewer.trial_view.strip import rows_json
from annotations.events import AcceptProposal, ClearRange, Edit, FlagRange, Proposal, SetActivity
from annotations.folding import folded
from annotations.reading import UnreadableRow
from annotations.suggested_activity import SuggestedActivity
from solver.kinematics.label_faults.fault import EXCHANGED, MASKED, LabelFault

FEET = ("calcn_r", "calcn_l")
SPITEFUL = "<img src=x onerror='window.hacked=1'>"


def edits(*events, author="Zoë"):
    return [Edit(i + 1, "walk", author, datetime.now(UTC), event) for i, event in enumerate(events)]


@pytest.fixture
def lanes(make_replay):
    def made(*events, author="Zoë", figures=None):
        replay, review = make_replay(), folded("walk", edits(*events, author=author), FEET)
        proposals = pending(replay.forces.proposals, review, {})
        found = lanes_of(
            replay, review, reviewed=((60, 80),), proposals=proposals, current=proposals[0], figures=figures
        )
        return {lane.label: lane.blocks for lane in found}

    return made


def test_contacts_stand_in_their_foots_lane_and_unmeasured_ones_are_hatched(lanes):
    right, left = (next(b for b in lanes()[f"{side} foot"] if b.bottom == 0) for side in ("right", "left"))
    assert (right.start, right.end, right.hatched) == (0, 60, False)
    assert (left.start, left.end, left.hatched, left.text) == (60, 120, True, "?")


def test_what_detection_leaves_out_is_hatched_until_somebody_decides_about_it(lanes):
    (alone,) = left_out(lanes())
    assert alone.hatched
    assert "not decided by anybody" in alone.told
    decided = lanes(
        FlagRange(30, 50, "forceDiscrepancy", "calcn_l", "odd"), ClearRange(60, 70, "calcn_l", "seen")
    )
    flag, rest = sorted(left_out(decided), key=lambda block: block.start)
    assert (rest.start, rest.end, rest.hatched) == (70, 80, True)
    assert (flag.start, flag.end, flag.text, flag.hatched) == (30, 50, "5", False)
    assert "Zoë" in flag.told
    assert (flag.is_flag, rest.is_flag) == (True, False)


def left_out(lanes, side="left"):
    """Blocks of a foot's lane that say what the next solve leaves out."""
    return [b for b in lanes[f"{side} foot"] if b.bottom > 0 and not b.text.startswith(("?", "✓", "✗"))]


def test_a_flag_of_both_feet_stands_in_both_lanes(lanes):
    found = lanes(FlagRange(30, 80, "manualReview"))
    assert [b.start for b in left_out(found, "right")] == [b.start for b in left_out(found)] == [30]


def test_proposals_are_as_high_as_they_are_sure_and_the_one_at_hand_is_outlined(lanes):
    right, left = proposed(lanes(), "right"), proposed(lanes(), "left")
    assert [b.start for b in right] == [20, 100]  # the first is about both feet
    assert [b.start for b in left] == [20, 60]
    assert right[0].outlined
    assert left[1].height > right[1].height > right[0].height
    accepted = AcceptProposal(Proposal(60, 80, "footContactDetectedButNoForce", "calcn_l"))
    assert [b.text[0] for b in proposed(lanes(accepted), "left")] == ["?", "✓"]


def proposed(lanes, side):
    """Blocks of a foot's lane that stand for proposals."""
    return [b for b in lanes[f"{side} foot"] if b.bottom > 0 and b.text[:1] in ("?", "✓", "✗")]


def test_every_frame_is_usable_or_says_why_not(lanes):
    found = lanes()["forces count"]
    assert [(b.start, b.end, b.told.split(":")[0]) for b in found] == [
        (0, 20, "does not count"),
        (20, 200, "counts"),
    ]


def test_of_a_flag_alone_the_borders_can_be_dragged(make_replay):
    replay, flag = make_replay(), FlagRange(30, 50, "forceDiscrepancy", "calcn_l", "odd")
    review = folded("walk", edits(flag), FEET)
    lanes = lanes_of(replay, review, reviewed=(), proposals=(), current=None, figures=None)
    blocks = [block for row in rows_json(lanes) for block in row["blocks"] if block["flag"]]
    assert [(b["start"], b["end"], b["foot"]) for b in blocks] == [(30, 50, "calcn_l")]
    assert all(b["top"] >= 0 and b["top"] + b["height"] <= 1.001 for b in blocks)


def test_causes_and_activities_have_their_lanes(lanes, effect, figures):
    named = figures(effect("external_contact", "pelvis", ((120, 140),), force_y_N=60.0))
    found = lanes(SetActivity(0, 200, "walk", "treadmill"), figures=named)
    assert [(b.start, b.end) for b in found[next(reversed(found))]] == [(120, 140)]
    assert found["activity"][0].text == "treadmill"


def test_suggested_activities_are_hatched_beside_what_people_said(make_replay):
    replay, review = make_replay(), folded("walk", edits(SetActivity(0, 120, "walk", "treadmill")), FEET)
    suggested = SuggestedActivity(120, 200, "run", "treadmill", 0.9)
    found = lanes_of(
        replay,
        review,
        reviewed=(),
        proposals=(),
        current=None,
        figures=None,
        suggested=(suggested,),
        chosen=(120, 200),
    )
    said, waiting = next(lane.blocks for lane in found if lane.label == "activity")
    assert (said.hatched, said.outlined) == (False, False)
    assert (waiting.start, waiting.end, waiting.hatched, waiting.outlined) == (120, 200, True, True)
    assert waiting.text == "run treadmill?"
    assert "nobody has said so" in waiting.told


def test_labels_have_a_lane_where_some_were_repaired(make_replay):
    swap = LabelFault(("RTH1", "RTH2"), 20, 60, EXCHANGED, 40, 0.04, 0.002, 4)
    crash = LabelFault(("<b>",), 70, 90, MASKED, 20, 0.08, None, 3)
    replay, review = make_replay(), folded("walk", [], FEET)

    def lanes(replay):
        return lanes_of(replay, review, reviewed=(), proposals=(), current=None, figures=None)

    assert "labels" not in [lane.label for lane in lanes(replay)]
    found = lanes(replace(replay, label_faults=(swap, crash)))
    (lane,) = [lane for lane in found if lane.label == "labels"]
    assert [(b.start, b.end, b.text, b.hatched) for b in lane.blocks] == [
        (20, 60, "RTH1 ⇄ RTH2", False),
        (70, 90, "<b> left out", True),
    ]
    assert lane.blocks[0].told == swap.note
    assert "<b>" not in lanes_html(found, Span(0, 199))


def test_whatever_people_and_files_say_stays_text(make_replay):
    replay = make_replay()
    forces = replay.forces
    object.__setattr__(replay, "forces", replace(forces, missing=((5, 9, None, SPITEFUL),), source=SPITEFUL))
    made = edits(FlagRange(0, 9, "manualReview", None, SPITEFUL), SetActivity(0, 9, "walk"), author=SPITEFUL)
    unreadable = (UnreadableRow(7, "walk", SPITEFUL, SPITEFUL),)
    for history in ([], made):
        review = folded("walk", history, FEET, unreadable)
        proposals = pending(forces.proposals, review, {})
        lanes = lanes_of(replay, review, reviewed=(), proposals=proposals, current=None, figures=None)
        page = [
            lanes_html(lanes, Span(0, 199)),
            ranges_html(review),
            history_html(history),
            proposals_html(proposals, proposals[0]),
        ]
        assert "<img" not in " ".join(page)


def test_a_trial_without_a_fit_is_not_said_to_be_without_proposals():
    nothing = folded("walk", [], FEET)
    assert "has not run" in proposals_html((), None, has_fit=False)
    assert "proposes nothing" in proposals_html((), None, has_fit=True)
    assert "None yet." in ranges_html(nothing)


def test_evidence_has_its_units(make_replay):
    proposals = pending(make_replay().forces.proposals, folded("walk", [], FEET), {})
    assert "512 N missing" in proposals_html(proposals, proposals[1])
    assert "sole moves at 0.02 m/s" in proposals_html(proposals, proposals[2])
