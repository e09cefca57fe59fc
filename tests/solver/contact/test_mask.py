from dataclasses import replace

import numpy as np
import pytest

from solver.contact.mask import frame_mask
from solver.contact.wrenches import TWO_FEET, ContactWrenches

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
