from dataclasses import replace

import numpy as np
import pytest

from annotations import activities
from solver.contact.mask import ERRONEOUS, OUTSIDE_RANGES, frame_mask
from solver.contact.wrenches import TWO_FEET, ContactWrenches
from solver.errors import FitError

FRAMES = 10


@pytest.fixture
def contacts():
    return ContactWrenches(
        foot_bodies=("calcn_r", "calcn_l"),
        wrench_ground=np.zeros((FRAMES, 2, 6)),
        cop_ground=np.full((FRAMES, 2, 3), np.nan),
        observed=np.ones(FRAMES, dtype=bool),
        in_contact=np.zeros((FRAMES, 2), dtype=bool),
        plate=np.zeros((FRAMES, 2), dtype=int),
        wrench_raw_ground=np.zeros((FRAMES, 2, 6)),
    )


def flags(*frames):
    marked = np.zeros(FRAMES, dtype=bool)
    marked[list(frames)] = True
    return marked


def test_everything_counts_when_nothing_speaks_against_it(contacts):
    mask = frame_mask(contacts, ~flags(), None)
    assert mask.all_feet.all()
    assert mask.source == "none"
    assert mask.reasons == ()


def test_each_reason_takes_out_its_own_frames_and_says_so(contacts):
    plate = contacts.plate.copy()
    plate[4:6, 1] = TWO_FEET
    given = replace(contacts, observed=~flags(9), plate=plate)
    mask = frame_mask(given, ~flags(0), flags(2, 3))
    np.testing.assert_array_equal(~mask.all_feet, flags(0, 2, 3, 4, 5, 9))
    assert [(start, end) for start, end, _, _ in mask.reasons] == [(0, 1), (2, 4), (4, 6), (9, 10)]
    assert mask.source == "review.json"


def test_an_imported_review_is_about_both_feet(contacts):
    mask = frame_mask(contacts, ~flags(), flags(2, 3))
    np.testing.assert_array_equal(~mask.counts, np.stack([flags(2, 3), flags(2, 3)], axis=1))
    assert mask.reasons == ((2, 4, None, "manualReview"),)


def test_a_persons_review_leaves_out_the_foot_that_it_names(contacts):
    review = ((4, 6, "calcn_l", "notOverForcePlate"), (1, 2, None, "forceDiscrepancy"))
    mask = frame_mask(contacts, ~flags(), None, review)
    np.testing.assert_array_equal(~mask.counts, np.stack([flags(1), flags(1, 4, 5)], axis=1))
    np.testing.assert_array_equal(~mask.all_feet, flags(1, 4, 5))
    assert mask.reasons == tuple(sorted(review))
    assert mask.source == "review"


def test_a_persons_review_comes_before_an_imported_one_even_when_it_finds_nothing_missing(contacts):
    mask = frame_mask(contacts, ~flags(), flags(2, 3), ())
    assert mask.counts.all()
    assert mask.source == "review"


def test_a_review_does_not_bring_back_what_was_never_recorded(contacts):
    mask = frame_mask(replace(contacts, observed=~flags(9)), ~flags(), None, ())
    np.testing.assert_array_equal(~mask.all_feet, flags(9))


def test_frames_outside_the_trials_ranges_do_not_count_whoever_reviewed_them(contacts):
    mask = frame_mask(contacts, ~flags(), flags(5), (), outside=flags(0, 1, 9))
    np.testing.assert_array_equal(~mask.counts, np.stack([flags(0, 1, 9)] * 2, axis=1))
    assert mask.reasons == ((0, 2, None, OUTSIDE_RANGES), (9, 10, None, OUTSIDE_RANGES))
    assert mask.source == "review"


def test_a_review_of_another_recording_or_foot_is_refused(contacts):
    with pytest.raises(FitError, match="Frames 8 to 11 are flagged, but the trial has 10"):
        frame_mask(contacts, ~flags(), None, ((8, 12, None, "manualReview"),))
    with pytest.raises(FitError, match="the foot 'toes_r', the subject has calcn_r, calcn_l"):
        frame_mask(contacts, ~flags(), None, ((8, 9, "toes_r", "manualReview"),))
    with pytest.raises(FitError, match="of 3 frames, the trial has 10"):
        frame_mask(contacts, ~flags(), np.zeros(3, dtype=bool))


def test_people_and_solver_call_an_erroneous_stretch_by_one_name():
    assert ERRONEOUS == activities.ERRONEOUS
