"""The fold, against hand-made cases and against a plain re-telling frame by frame."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from annotations.errors import ReviewError
from annotations.events import (
    AcceptProposal,
    ClearRange,
    Edit,
    FlagRange,
    ImportLabels,
    Proposal,
    RejectProposal,
    SetActivity,
    SetStatus,
    Status,
    Undo,
)
from annotations.folding import folded

FEET = ("calcn_r", "calcn_l")
RIGHT, LEFT = FEET


def fold(edits, feet=FEET):
    return folded("walk", edits, feet)


def flags(review):
    return [(flag.start, flag.end, flag.foot, flag.reason) for flag in review.flags]


def missing_frames(review, foot, frames=50):
    return np.flatnonzero(review.missing(frames)[:, FEET.index(foot)]).tolist()


def test_nothing_said():
    review = fold(())
    assert review.status is Status.UNSEEN
    assert not review.decided
    assert not review.missing(5).any()
    assert review.missing(5).shape == (5, 2)


def test_a_flag_is_about_its_own_foot(edits):
    review = fold(edits(("anna", FlagRange(3, 6, "notOverForcePlate", LEFT, "on the edge"))))
    assert missing_frames(review, LEFT) == [3, 4, 5]
    assert missing_frames(review, RIGHT) == []
    (flag,) = review.flags
    assert (flag.foot, flag.reason, flag.source, flag.author, flag.edit, flag.note) == (
        LEFT, "notOverForcePlate", "person", "anna", 1, "on the edge",
    )  # fmt: skip
    assert review.decided
    assert review.status is Status.IN_WORK


def test_a_later_flag_or_clear_wins_where_they_overlap(edits):
    review = fold(
        edits(
            ("anna", FlagRange(10, 20, "manualReview")),
            ("anna", FlagRange(15, 25, "forceDiscrepancy", RIGHT)),
            ("anna", ClearRange(12, 14)),
        )
    )
    assert flags(review) == [
        (10, 12, None, "manualReview"),
        (14, 15, RIGHT, "manualReview"),
        (14, 20, LEFT, "manualReview"),
        (15, 25, RIGHT, "forceDiscrepancy"),
    ]
    assert review.conflicts == ()


def test_an_undone_edit_leaves_what_was_under_it(edits):
    review = fold(
        edits(("anna", FlagRange(0, 9, "manualReview")), ("anna", ClearRange(0, 9)), ("anna", Undo(2)))
    )
    assert flags(review) == [(0, 9, None, "manualReview")]


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_an_import_never_changes_a_persons_label_whichever_came_first(edits, order):
    said = [("imported", ImportLabels(((0, 10),), 40, False)), ("anna", ClearRange(4, 6, RIGHT))]
    review = fold(edits(*(said[k] for k in order)))
    assert missing_frames(review, RIGHT) == [0, 1, 2, 3, 6, 7, 8, 9]
    assert missing_frames(review, LEFT) == list(range(10))
    assert {flag.source for flag in review.flags} == {"imported"}
    assert review.conflicts == ()


def test_a_new_import_replaces_the_one_before(edits):
    review = fold(
        edits(
            ("imported", ImportLabels(((0, 10),), 40, False)),
            ("imported", ImportLabels(((30, 40),), 40, True)),
        )
    )
    assert flags(review) == [(30, 40, None, "manualReview")]
    assert not review.decided
    assert (review.status, review.status_author) == (Status.FINISHED, "imported")


def test_an_accepted_proposal_is_a_persons_label_with_its_source(edits):
    proposal = Proposal(5, 8, "missingBlip", RIGHT, 0.9)
    review = fold(edits(("anna", AcceptProposal(proposal))))
    assert flags(review) == [(5, 8, RIGHT, "missingBlip")]
    assert (review.flags[0].source, review.flags[0].author) == ("accepted proposal", "anna")
    assert review.accepted == (proposal,)
    assert review.decided


def test_a_rejected_proposal_overrules_imported_labels_but_nobodys_own_flag(edits):
    proposal = Proposal(0, 10, "missingBlip")
    review = fold(
        edits(
            ("imported", ImportLabels(((0, 10),), 10, True)),
            ("anna", FlagRange(2, 4, "forceDiscrepancy", RIGHT)),
            ("ben", RejectProposal(proposal)),
        )
    )
    assert flags(review) == [(2, 4, RIGHT, "forceDiscrepancy")]
    assert review.conflicts == ()
    assert review.rejected == (proposal,)


def test_two_persons_who_differ_are_both_named_and_the_later_edit_counts(edits):
    review = fold(
        edits(
            ("anna", FlagRange(10, 20, "notOverForcePlate", RIGHT)),
            ("ben", ClearRange(15, 30)),
            ("ben", FlagRange(10, 12, "notOverForcePlate", RIGHT)),
        )
    )
    assert missing_frames(review, RIGHT) == [10, 11, 12, 13, 14]
    (conflict,) = review.conflicts
    assert (conflict.start, conflict.end, conflict.foot) == (15, 20, RIGHT)
    assert (conflict.earlier.author, conflict.earlier.edit) == ("anna", 1)
    assert (conflict.later.author, conflict.later.edit) == ("ben", 2)
    assert str(conflict) == (
        "frames 15 to 19, calcn_r: anna says 'notOverForcePlate' (edit 1), ben says 'notMissingGRF' (edit 2)"
        "; the later one, ben's, counts"
    )


def test_a_conflict_ends_when_one_gives_in_or_takes_back(edits):
    said = [("anna", FlagRange(10, 20, "manualReview")), ("ben", ClearRange(10, 20))]
    assert fold(edits(*said)).conflicts
    assert not fold(edits(*said, ("anna", ClearRange(10, 20)))).conflicts
    assert not fold(edits(*said, ("ben", Undo(2)))).conflicts


def test_activities_are_labelled_by_range_and_differing_ones_told(edits):
    review = fold(
        edits(
            ("anna", SetActivity(0, 40, "walk", "treadmill")),
            ("ben", SetActivity(30, 40, "run")),
        )
    )
    found = [(a.start, a.end, a.activity, a.subclass, a.author) for a in review.activities]
    assert found == [(0, 30, "walk", "treadmill", "anna"), (30, 40, "run", None, "ben")]
    assert [(c.start, c.end, c.earlier.label, c.later.label) for c in review.conflicts] == [
        (30, 40, "walk treadmill", "run")
    ]
    assert not review.missing(40).any()
    assert not review.decided
    assert review.status is Status.IN_WORK


def test_an_erroneous_stretch_is_not_used_for_any_foot(edits):
    review = fold(edits(("anna", SetActivity(5, 8, "erroneous")), ("anna", ClearRange(0, 20))))
    assert review.missing_ranges == ((5, 8, None, "manualReview"),)
    assert missing_frames(review, RIGHT) == missing_frames(review, LEFT) == [5, 6, 7]


def test_the_last_status_counts_and_says_whose_it_is(edits):
    said = [("anna", SetStatus(Status.FINISHED)), ("ben", SetStatus(Status.SECOND_LOOK))]
    assert (fold(edits(*said)).status, fold(edits(*said)).status_author) == (Status.SECOND_LOOK, "ben")
    assert fold(edits(*said, ("ben", Undo(2)))).status is Status.FINISHED


@pytest.mark.parametrize(
    ("status", "decided"),
    [
        (Status.UNSEEN, False),
        (Status.IN_WORK, True),
        (Status.FINISHED, True),
        (Status.SECOND_LOOK, True),
    ],
)
def test_a_trial_is_decided_once_somebody_took_it_in_hand(edits, status, decided):
    assert fold(edits(("anna", SetStatus(status)))).decided is decided


def test_an_erroneous_stretch_decides_about_forces(edits):
    assert fold(edits(("anna", SetActivity(5, 8, "erroneous")))).decided


def test_a_foot_that_the_subject_does_not_have_is_named(edits):
    with pytest.raises(
        ReviewError, match=r"walk: edit 1 by anna is about the foot 'toes_r'.*calcn_r, calcn_l"
    ):
        fold(edits(("anna", FlagRange(0, 3, "manualReview", "toes_r"))))


def test_a_label_beyond_the_trial_is_named(edits):
    review = fold(edits(("anna", FlagRange(230, 250, "manualReview"))))
    with pytest.raises(ReviewError, match="frames 230 to 249 are labelled, but the trial has 238"):
        review.missing(238)


FRAMES = 12
_ranges = st.tuples(st.integers(0, FRAMES - 1), st.integers(1, FRAMES)).map(
    lambda ends: (min(ends[0], FRAMES - 1), max(ends[0] + 1, ends[1]))
)
_feet = st.sampled_from((None, *FEET))
_events = st.one_of(
    st.builds(lambda r, foot: FlagRange(*r, "manualReview", foot), _ranges, _feet),
    st.builds(lambda r, foot: FlagRange(*r, "missingBlip", foot), _ranges, _feet),
    st.builds(lambda r, foot: ClearRange(*r, foot), _ranges, _feet),
    st.builds(lambda r, foot: AcceptProposal(Proposal(*r, "missingBlip", foot)), _ranges, _feet),
    st.builds(lambda r: ImportLabels((r,), FRAMES, False), _ranges),
)


def retold(said, undone):
    """Reason (None: counts) by frame and foot, told edit by edit without arrays."""
    by_persons, imported = {}, {}
    for number, (_, event) in enumerate(said, start=1):
        if number in undone:
            continue
        if isinstance(event, ImportLabels):
            imported = {(t, foot): "manualReview" for t in range(*event.missing[0]) for foot in FEET}
            continue
        about = event.proposal if isinstance(event, AcceptProposal) else event
        for t in range(about.start, about.end):
            for foot in FEET if about.foot is None else (about.foot,):
                by_persons[t, foot] = getattr(about, "reason", None)
    return imported | by_persons


@given(
    st.lists(st.tuples(st.sampled_from(("anna", "ben", "cleo")), _events), max_size=12),
    st.sets(st.integers(1, 12), max_size=5),
)
def test_the_fold_is_what_telling_it_edit_by_edit_gives(said, undone):
    said = [("imported" if isinstance(event, ImportLabels) else who, event) for who, event in said]
    undone = {number for number in undone if number <= len(said)}
    taken_back = [("anna", Undo(number)) for number in sorted(undone)]
    log = [Edit(k, "walk", who, None, event) for k, (who, event) in enumerate([*said, *taken_back], start=1)]
    review = fold(log)
    expected = retold(said, undone)
    found = {}
    for flag in review.flags:
        for t in range(flag.start, flag.end):
            for foot in FEET if flag.foot is None else (flag.foot,):
                assert (t, foot) not in found, "ranges of a foot overlap"
                found[t, foot] = flag.reason
    assert found == {place: reason for place, reason in expected.items() if reason is not None}
    told = {(t, foot) for t, foot in np.argwhere(review.missing(FRAMES)).tolist()}
    assert told == {(t, FEET.index(foot)) for t, foot in found}
