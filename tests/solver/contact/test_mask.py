import numpy as np
import pytest

from solver.contact.mask import NOT_RECORDED, REVIEWED, TWO_FEET_ON_ONE_PLATE, frame_mask
from solver.contact.wrenches import TWO_FEET, ContactWrenches
from solver.errors import FitError


@pytest.fixture
def contacts() -> ContactWrenches:
    """Ten frames, two feet, one plate: not recorded on the first two, two feet on it at 5 and 6."""
    observed, plate = np.ones(10, dtype=bool), np.zeros((10, 1), dtype=int)
    observed[:2] = False
    plate[5:7] = TWO_FEET
    return ContactWrenches(
        foot_bodies=("calcn_r", "calcn_l"),
        wrench_ground=np.zeros((10, 2, 6)),
        cop_ground=np.full((10, 2, 3), np.nan),
        observed=observed,
        in_contact=np.zeros((10, 2), dtype=bool),
        plate=plate,
        wrench_raw_ground=np.zeros((10, 2, 6)),
    )


def test_what_was_not_measured_does_not_count(contacts):
    mask = frame_mask(contacts)
    np.testing.assert_array_equal(np.flatnonzero(mask.all_feet), [2, 3, 4, 7, 8, 9])
    assert mask.reasons == ((0, 2, None, NOT_RECORDED), (5, 7, None, TWO_FEET_ON_ONE_PLATE))
    assert mask.source == "none"


def test_a_review_adds_to_it(contacts):
    flagged = np.zeros(10, dtype=bool)
    flagged[4:6] = True
    mask = frame_mask(contacts, flagged)
    np.testing.assert_array_equal(np.flatnonzero(mask.all_feet), [2, 3, 7, 8, 9])
    assert (4, 6, None, REVIEWED) in mask.reasons
    assert mask.source == "review.json"


def test_a_review_of_another_length_is_an_error(contacts):
    with pytest.raises(FitError, match="9 frames, the trial has 10"):
        frame_mask(contacts, np.zeros(9, dtype=bool))
