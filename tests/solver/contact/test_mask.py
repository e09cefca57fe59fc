from dataclasses import replace

import numpy as np
import pytest

from annotations import activities
from solver.capture.capture import Capture, Markers
from solver.common.errors import FitError
from solver.contact.force_review import ForceLabel, ForceReview
from solver.contact.mask import ERRONEOUS, NOT_RECORDED, OUTSIDE_RANGES, frame_mask, mask_of, with_own_file
from solver.contact.wrenches import DETECTION, FILE, NOBODY, PERSON, RECORDING, TWO_FEET, ContactWrenches

FRAMES, FEET = 10, ("calcn_r", "calcn_l")
FLAGGED, COUNTS = "notOverForcePlate", None


@pytest.fixture
def contacts():
    return ContactWrenches(
        foot_bodies=FEET,
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


def label(start, end, foot=None, reason=FLAGGED):
    return ForceLabel(start, end, foot, reason)


def recording(missing=None, reviewed=None):
    markers = Markers(("HEAD",), np.zeros((FRAMES, 1, 3)), 100.0)
    return Capture("walk", markers, imported_missing_force=missing, imported_reviewed=reviewed)


def decided(by_people=(), by_file=None, proposed=(), stays_out=None, gaps=()):
    """The rule alone, on ten frames."""
    return mask_of(FEET, FRAMES, gaps, ForceReview(tuple(by_people), by_file, stays_out), proposed)


def test_everything_counts_when_nothing_speaks_against_it(contacts):
    mask = frame_mask(contacts, ~flags())
    assert mask.all_feet.all()
    assert (mask.source, mask.reasons) == (NOBODY, ())
    assert mask.decided(NOBODY).all()


def test_each_reason_takes_out_its_own_frames_and_says_so(contacts):
    plate = contacts.plate.copy()
    plate[4:6, 1] = TWO_FEET
    given = replace(contacts, observed=~flags(9), plate=plate)
    mask = frame_mask(given, ~flags(0), with_own_file(ForceReview(), recording(flags(2, 3))))
    np.testing.assert_array_equal(~mask.all_feet, flags(0, 2, 3, 4, 5, 9))
    assert [(start, end) for start, end, _, _ in mask.reasons] == [(0, 1), (2, 4), (4, 6), (9, 10)]
    assert mask.sources == (RECORDING, FILE, RECORDING, RECORDING)
    assert mask.source == FILE


def test_an_imported_review_is_about_both_feet_and_all_of_its_frames():
    review = with_own_file(ForceReview(), recording(flags(2, 3)))
    mask = mask_of(FEET, FRAMES, (), review, ((0, 10, None, "forceDiscrepancy"),))
    np.testing.assert_array_equal(~mask.counts, np.stack([flags(2, 3), flags(2, 3)], axis=1))
    assert mask.reasons == ((2, 4, None, "manualReview"),)
    assert mask.decided(FILE).all(), "where it leaves nothing out it says that the force counts"


def test_detection_decides_where_no_segment_of_the_imported_review_lies():
    review = with_own_file(ForceReview(), recording(flags(2), ~flags(7, 8, 9)))
    mask = mask_of(FEET, FRAMES, (), review, ((5, 9, None, "forceDiscrepancy"),))
    np.testing.assert_array_equal(~mask.all_feet, flags(2, 7, 8))
    assert mask.source == f"{FILE} + {DETECTION}"
    assert mask.reasons[-1] == (7, 9, None, "forceDiscrepancy")


def test_a_person_leaves_out_the_foot_that_they_name():
    mask = decided([label(4, 6, "calcn_l"), label(1, 2, None, "forceDiscrepancy")])
    np.testing.assert_array_equal(~mask.counts, np.stack([flags(1), flags(1, 4, 5)], axis=1))
    assert mask.reasons == ((1, 2, None, "forceDiscrepancy"), (4, 6, "calcn_l", FLAGGED))
    assert mask.source == PERSON


def test_one_decision_leaves_what_detection_says_elsewhere_as_it_is():
    proposed = (
        (0, 4, "calcn_r", "missingBlip"),
        (2, 6, "calcn_l", "forceDiscrepancy"),
        (8, 9, None, FLAGGED),
    )
    before = decided(proposed=proposed)
    accepted = decided([label(0, 4, "calcn_r", "missingBlip")], proposed=proposed)
    np.testing.assert_array_equal(before.counts, accepted.counts)
    assert accepted.reasons == before.reasons
    assert before.source == DETECTION
    assert (accepted.source, accepted.sources) == (f"{PERSON} + {DETECTION}", (PERSON, DETECTION, DETECTION))
    np.testing.assert_array_equal(accepted.decided(PERSON), np.stack([flags(0, 1, 2, 3), flags()], axis=1))


def test_a_rejected_proposal_counts_and_a_piece_of_it_that_nobody_decided_does_not():
    mask = decided([label(3, 6, "calcn_r", COUNTS)], proposed=((2, 8, None, FLAGGED),))
    np.testing.assert_array_equal(~mask.counts[:, 0], flags(2, 6, 7))
    np.testing.assert_array_equal(~mask.counts[:, 1], flags(2, 3, 4, 5, 6, 7))
    assert mask.reasons == (
        (2, 3, "calcn_r", FLAGGED),
        (2, 8, "calcn_l", FLAGGED),
        (6, 8, "calcn_r", FLAGGED),
    )


SAYINGS = {"nothing": (), "counts": ((0, 10, None, COUNTS),), "left out": ((0, 10, None, FLAGGED),)}


@pytest.mark.parametrize("by_person", SAYINGS)
@pytest.mark.parametrize("by_file", SAYINGS)
@pytest.mark.parametrize("by_detection", ["nothing", "left out"])
@pytest.mark.parametrize("finished", [False, True])
def test_the_first_who_says_anything_decides(by_person, by_file, by_detection, finished):
    """All cases of one frame and foot."""
    found = SAYINGS[by_detection]
    mask = decided(
        [label(*said) for said in SAYINGS[by_person]],
        tuple(label(*said) for said in SAYINGS[by_file]),
        () if finished else found,
        found if finished else None,
    )
    order = ((by_person, PERSON), (by_file, FILE), (by_detection, DETECTION))
    expected = next(
        (each for each in order if each[0] != "nothing"), ("counts", PERSON if finished else NOBODY)
    )
    assert (mask.counts == (expected[0] == "counts")).all()
    assert mask.decided(expected[1]).all()
    assert mask.source == expected[1]


def test_a_persons_word_goes_before_a_files_and_a_files_before_detections():
    mask = decided(
        [label(0, 2, None, COUNTS), label(2, 3)],
        (label(0, 3, None, "manualReview"), label(3, 5, None, COUNTS)),
        ((0, 7, None, "missingBlip"),),
    )
    np.testing.assert_array_equal(~mask.all_feet, flags(2, 5, 6))
    assert [*zip(mask.reasons, mask.sources, strict=True)] == [
        ((2, 3, None, FLAGGED), PERSON),
        ((5, 7, None, "missingBlip"), DETECTION),
    ]


def test_a_finished_review_is_not_changed_by_what_detection_finds_later():
    kept = ((4, 6, None, "missingBlip"),)
    mask = decided([label(0, 1)], None, ((7, 9, None, "missingBlip"),), stays_out=kept)
    np.testing.assert_array_equal(~mask.all_feet, flags(0, 4, 5))
    assert mask.source == f"{PERSON} + {DETECTION}"
    np.testing.assert_array_equal(mask.decided(DETECTION).all(axis=1), flags(4, 5))
    assert mask.decided(PERSON).sum() == 16, "whoever finished has looked at the rest"


def test_a_review_does_not_bring_back_what_was_never_recorded():
    gap = (8, 10, None, NOT_RECORDED)
    mask = decided([label(7, 10, None, COUNTS)], gaps=(gap,))
    np.testing.assert_array_equal(~mask.all_feet, flags(8, 9))
    assert (mask.reasons, mask.sources) == ((gap,), (RECORDING,))


def test_an_erroneous_stretch_does_not_count_whatever_the_flags_in_it_say():
    said = [label(2, 5, None, ERRONEOUS), label(0, 9, "calcn_r", COUNTS)]
    mask = decided(said)
    np.testing.assert_array_equal(~mask.all_feet, flags(2, 3, 4))
    assert mask.reasons == ((2, 5, None, ERRONEOUS),)


def test_frames_outside_the_trials_ranges_do_not_count_whoever_reviewed_them(contacts):
    mask = frame_mask(contacts, ~flags(), ForceReview(stays_out=()), outside=flags(0, 1, 9))
    np.testing.assert_array_equal(~mask.counts, np.stack([flags(0, 1, 9)] * 2, axis=1))
    assert mask.reasons == ((0, 2, None, OUTSIDE_RANGES), (9, 10, None, OUTSIDE_RANGES))
    assert mask.source == PERSON


def test_a_review_of_another_recording_or_foot_is_refused():
    with pytest.raises(FitError, match="Frames 8 to 11 are flagged, but the trial has 10"):
        decided([label(8, 12)])
    with pytest.raises(FitError, match="the foot 'toes_r', the subject has calcn_r, calcn_l"):
        decided([label(8, 9, "toes_r")])
    with pytest.raises(FitError, match="of 3 frames, the trial has 10"):
        with_own_file(ForceReview(), recording(np.zeros(3, dtype=bool)))


def test_people_and_solver_call_an_erroneous_stretch_by_one_name():
    assert ERRONEOUS == activities.ERRONEOUS
