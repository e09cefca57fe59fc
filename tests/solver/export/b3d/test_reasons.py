"""Our reasons against the format's numbers."""

import numpy as np

from annotations import reasons as spoken
from solver.capture.formats.b3d.reasons import REASONS
from solver.contact import mask as contact_mask
from solver.contact.wrenches import DETECTION, PERSON, RECORDING, SOURCES, FrameMask
from solver.export.b3d.reasons import NEAREST, reason_number, reasons_per_frame


def test_the_numbers_of_the_format():
    """A few by hand, from the format's own list."""
    numbers = {
        "notMissingGRF": 0,
        "notOverForcePlate": 5,
        "manualReview": 10,
        "hasNoForcePlateData": 14,
        "extendedToNearestPeakForce": 18,
    }
    assert {name: reason_number(name) for name in numbers} == numbers


def test_people_choose_from_the_same_list():
    assert spoken.REASONS == REASONS


def test_every_reason_of_the_mask_has_a_number():
    own = {value for name, value in vars(contact_mask).items() if name.isupper() and isinstance(value, str)}
    own -= {*SOURCES, RECORDING}  # who says so, not why
    assert own <= set(REASONS) | set(NEAREST)
    assert set(NEAREST.values()) <= set(REASONS)


def test_words_of_a_person_are_a_manual_review():
    assert reason_number("shoe came off") == 10


def test_frame_by_frame():
    counts = np.ones((8, 2), dtype=bool)
    counts[1:4, 0] = counts[3:6, 1] = counts[7] = False
    mask = FrameMask(
        counts,
        (
            (1, 4, "calcn_r", "notOverForcePlate"),
            (3, 6, "calcn_l", "copOutsideConvexFootError"),
            (4, 5, None, "manualReview"),
            (0, 1, None, "forceDiscrepancy"),  # a reason, but the force counts all the same
        ),
    )
    assert reasons_per_frame(mask, 8).tolist() == [0, 5, 5, 5, 10, 16, 0, 2]


def test_a_persons_reason_goes_before_detections_and_the_recordings_own():
    mask = FrameMask(
        np.zeros((4, 2), dtype=bool),
        (
            (0, 4, None, "hasNoForcePlateData"),
            (1, 4, "calcn_r", "forceDiscrepancy"),
            (2, 3, "calcn_l", "notOverForcePlate"),
        ),
        sources=(RECORDING, DETECTION, PERSON),
    )
    assert reasons_per_frame(mask, 4).tolist() == [14, 4, 5, 4]


def test_without_forces():
    assert reasons_per_frame(None, 3).tolist() == [14, 14, 14]
