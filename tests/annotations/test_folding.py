"""The fold, against hand-made cases and against a plain re-telling frame by frame."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from annotations.events import (
    AcceptProposal,
    ClearActivity,
    ClearRange,
    Edit,
    FlagRange,
    ImportLabels,
    ImportTable,
    Proposal,
    RejectProposal,
    SetActivity,
    SetStatus,
    Status,
    Undo,
)
from annotations.folding import folded
from annotations.review_errors import ReviewError

FEET = ("calcn_r", "calcn_l")
RIGHT, LEFT = FEET


def fold(edits, feet=FEET):
    return folded("walk", edits, feet)


def flags(review):
    return [(flag.start, flag.end, flag.foot, flag.reason) for flag in review.flags]


def judged_frames(review, foot, frames=50):
    return np.flatnonzero(review.judged(frames)[:, FEET.index(foot)]).tolist()


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
    proposal = Proposal(5, 8, "missingBlip", RIGHT, 0.9, {"gap_N": 70.0}, "addb-viewer 0.1.0")
    review = fold(edits(("anna", AcceptProposal(proposal))))
    assert flags(review) == [(5, 8, RIGHT, "missingBlip")]
    assert (review.flags[0].source, review.flags[0].author) == ("accepted proposal", "anna")
    assert (review.flags[0].confidence, review.flags[0].detector) == (0.9, "addb-viewer 0.1.0")
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
    assert {cleared.source for cleared in review.cleared} == {"rejected proposal"}
    assert judged_frames(review, RIGHT) == judged_frames(review, LEFT) == list(range(10))


def test_where_the_force_counts_by_decision_is_told_from_where_nobody_has_decided(edits):
    review = fold(
        edits(
            ("imported", ImportLabels(((0, 10),), 40, False)),
            ("anna", ClearRange(5, 20, LEFT, "looked twice")),
            ("anna", FlagRange(18, 22, "missingBlip")),
        )
    )
    (cleared,) = review.cleared
    assert (cleared.start, cleared.end, cleared.foot, cleared.note) == (5, 18, LEFT, "looked twice")
    assert (cleared.source, cleared.author, cleared.edit) == ("person", "anna", 2)
    assert judged_frames(review, LEFT) == list(range(5, 22))
    assert judged_frames(review, RIGHT) == [18, 19, 20, 21]


def test_an_imported_table_has_a_label_for_each_of_its_ranges(edits):
    table = ImportTable(
        "S04.csv",
        "ben",
        (FlagRange(0, 10, "missingBlip", LEFT, "a"), FlagRange(5, 12, "zeroForceFrame"), ClearRange(7, 8)),
        (SetActivity(0, 30, "walk"),),
        Status.SECOND_LOOK,
        "which plate?",
    )
    review = fold(edits(("imported", table)))
    assert flags(review) == [
        (0, 5, LEFT, "missingBlip"),
        (5, 7, None, "zeroForceFrame"),
        (8, 12, None, "zeroForceFrame"),
    ]
    assert {(flag.source, flag.author, flag.edit) for flag in review.flags} == {("imported", "imported", 1)}
    assert [(c.start, c.end, c.source) for c in review.cleared] == [(7, 8, "imported")]
    assert [(a.start, a.end, a.label) for a in review.activities] == [(0, 30, "walk")]
    assert (review.status, review.status_author, review.status_note) == (
        Status.SECOND_LOOK,
        "imported",
        "which plate?",
    )
    assert review.decided  # somebody took it in to be used
    assert not review.judged(40).any()


def test_an_imported_table_takes_the_place_of_what_was_imported_before_and_leaves_peoples_labels(edits):
    said = [
        ("anna", FlagRange(20, 25, "forceDiscrepancy", RIGHT)),
        ("anna", SetActivity(0, 5, "squat")),
        ("imported", ImportLabels(((0, 10),), 40, True)),
        (
            "imported",
            ImportTable("a.csv", "ben", (FlagRange(18, 22, "missingBlip"),), (SetActivity(0, 9, "run"),)),
        ),
    ]
    review = fold(edits(*said))
    assert flags(review) == [
        (18, 20, RIGHT, "missingBlip"),
        (18, 22, LEFT, "missingBlip"),
        (20, 25, RIGHT, "forceDiscrepancy"),
    ]
    assert [(a.start, a.end, a.label) for a in review.activities] == [(0, 5, "squat"), (5, 9, "run")]
    assert review.conflicts == ()
    assert flags(fold(edits(*said, ("ben", Undo(4)))))[0] == (0, 10, None, "manualReview")
    assert flags(fold(edits(*said, ("imported", ImportLabels((), 40, True))))) == [
        (20, 25, RIGHT, "forceDiscrepancy")
    ]


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
        edits(("anna", SetActivity(0, 40, "walk", "treadmill")), ("ben", SetActivity(30, 40, "run")))
    )
    found = [(a.start, a.end, a.activity, a.subclass, a.author) for a in review.activities]
    assert found == [(0, 30, "walk", "treadmill", "anna"), (30, 40, "run", None, "ben")]
    assert [(c.start, c.end, c.earlier.label, c.later.label) for c in review.conflicts] == [
        (30, 40, "walk treadmill", "run")
    ]
    assert not review.missing(40).any()
    assert not review.decided
    assert review.status is Status.IN_WORK


def test_an_activity_is_taken_back(edits):
    said = [
        ("anna", SetActivity(0, 40, "walk", "treadmill", "belt at 1.2 m/s")),
        ("ben", ClearActivity(10, 20)),
    ]
    review = fold(edits(*said))
    assert [(a.start, a.end) for a in review.activities] == [(0, 10), (20, 40)]
    assert {a.note for a in review.activities} == {"belt at 1.2 m/s"}
    assert "ben says 'nothing' (edit 2)" in str(review.conflicts[0])
    labels = review.activity_labels(50)
    assert np.flatnonzero(labels == "walk treadmill").tolist() == [*range(10), *range(20, 40)]
    assert set(labels.tolist()) == {"", "walk treadmill"}


def test_an_erroneous_stretch_is_not_used_for_any_foot(edits):
    review = fold(edits(("anna", SetActivity(5, 8, "erroneous")), ("anna", ClearRange(0, 20))))
    assert review.missing_ranges == ((5, 8, None, "erroneous"),)
    assert missing_frames(review, RIGHT) == missing_frames(review, LEFT) == [5, 6, 7]


def test_the_last_status_counts_and_says_whose_it_is(edits):
    said = [("anna", SetStatus(Status.FINISHED)), ("ben", SetStatus(Status.SECOND_LOOK))]
    assert (fold(edits(*said)).status, fold(edits(*said)).status_author) == (Status.SECOND_LOOK, "ben")
    assert fold(edits(*said, ("ben", Undo(2)))).status is Status.FINISHED
    noted = fold(edits(("anna", SetStatus(Status.SECOND_LOOK, "plate 2 drifts"))))
    assert noted.status_note == "plate 2 drifts"


def test_conflicts_are_found_by_the_edit_that_they_are_about(edits):
    review = fold(
        edits(
            ("anna", FlagRange(0, 5, "manualReview")),
            ("anna", FlagRange(10, 15, "manualReview")),
            ("ben", ClearRange(3, 20)),
        )
    )
    assert [[c.start for c in review.conflicts_of(edit)] for edit in (1, 2, 3, 4)] == [[3], [10], [3, 10], []]


@pytest.mark.parametrize(
    ("status", "decided"),
    [(Status.UNSEEN, False), (Status.IN_WORK, True), (Status.FINISHED, True), (Status.SECOND_LOOK, True)],
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
