"""The regression on a synthetic balance: two contacts of a point mass whose forces are known exactly."""

import numpy as np
import pytest

from solver.contact.detection_balance import BodyMotion, WholeBody
from solver.contact.detection_settings import PART_COST, DetectionSettings
from solver.contact.detection_shares import Explained, WrenchBalance

RATE, FRAMES, MASS, GRAVITY = 100.0, 240, 70.0, 9.80665
SETTINGS = DetectionSettings()
WEIGHT = MASS * GRAVITY
ALL = np.ones(FRAMES, dtype=bool)


@pytest.fixture
def still():
    """A body at rest, and the wrenches of a right contact, then a left one: each carries all of it."""
    com = np.tile([0.0, 0.9, 0.0], (FRAMES, 1))
    motion = BodyMotion(com, np.zeros((FRAMES, 3)), ALL, RATE, MASS, GRAVITY)
    right, left = np.zeros((FRAMES, 6)), np.zeros((FRAMES, 6))
    right[:120, 1] = left[120:, 1] = WEIGHT  # under the centre of mass: no moment about it
    return WholeBody(motion, SETTINGS.place_cutoff_Hz), right, left


def wrench_balance(body, right, left):
    return WrenchBalance.of(body, right + left, [(0, right), (0, left)], [0, 1])


def test_whole_contacts_are_left_alone(still):
    body, right, left = still
    found = wrench_balance(body, right, left).explain(ALL, SETTINGS)
    np.testing.assert_array_equal(found.missing, 0.0)
    np.testing.assert_allclose(found.trial, 0.0, atol=1e-3)


def test_a_contact_measured_to_two_thirds_gets_the_other_half_again(still):
    body, right, left = still
    book = wrench_balance(body, right, 2 / 3 * left)
    found = book.explain(ALL, SETTINGS)
    assert found.missing[0] == 0.0
    assert found.missing[1] == pytest.approx(0.5, abs=0.03)
    assert found.evidence[1] > 5 * PART_COST
    assert np.abs(book.missing(found)[:, 1]).max() < 0.05 * WEIGHT


def test_a_small_scale_error_belongs_to_the_trial(still):
    body, right, left = still
    found = wrench_balance(body, 0.95 * right, 0.95 * left).explain(ALL, SETTINGS)
    np.testing.assert_array_equal(found.missing, 0.0)
    assert found.trial[0] == pytest.approx(0.05, abs=0.02)


def test_frames_that_miss_other_forces_have_no_say(still):
    body, right, left = still
    hidden = left.copy()
    hidden[160:] = 0.0
    usable = ALL.copy()
    usable[140:] = False
    found = wrench_balance(body, right, hidden).explain(usable, SETTINGS)
    np.testing.assert_array_equal(found.missing, 0.0)


def test_without_usable_frames_nothing_is_learnt(still):
    found = wrench_balance(*still).explain(~ALL, SETTINGS)
    expected = Explained.nothing(2, SETTINGS)
    np.testing.assert_array_equal(found.missing, expected.missing)
    np.testing.assert_array_equal(found.covariance, expected.covariance)
