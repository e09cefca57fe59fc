"""How much force is missing under a foot, against forces that are known."""

import numpy as np

from addb_viewer.trial_view.missing_force import LargestMissing, MissingForce, missing_force

UP = np.array([0.0, 1.0, 0.0])


def upward(*newtons):
    """Of each frame and foot."""
    return np.array(newtons, dtype=float)[..., None] * UP


def test_it_is_what_a_standing_person_weighs_less_what_plates_say():
    """700 N: on both plates; the right one reads 200 N less; the left foot stands beside its plate."""
    found = missing_force(
        demand=upward(700, 700, 700),
        predicted=upward((0, 0), (0, 0), (0, 400)),
        measured=upward((300, 400), (100, 400), (300, 0)),
        counts=np.array([(True, True), (True, True), (True, False)]),
    )
    np.testing.assert_allclose(found.of_all, [0, 200, 400])
    np.testing.assert_allclose(found.of_feet[:, 1], [0, 200, 400])
    np.testing.assert_allclose(found.of_feet[:, 0], [0, 200, 0])


def test_a_foot_that_does_not_count_lacks_only_what_its_plate_did_not_measure():
    found = missing_force(upward(700), upward((0, 450)), upward((300, 120)), counts=np.array([(True, False)]))
    np.testing.assert_allclose(found.of_feet, [[50, 330]])  # the right one counts: 700 − 300 − 450 = −50
    np.testing.assert_allclose(found.of_all, [280])


def test_the_largest_is_of_the_range_and_the_foot_and_unknown_frames_are_none():
    sizes = np.array([[9.0, 1.0], [np.nan, 2.0], [3.0, 8.0], [7.0, 5.0]])
    found = MissingForce(sizes, sizes.sum(axis=1))
    assert found.largest(1, 4, 0) == LargestMissing(3, 7.0)
    assert found.largest(1, 4, 1) == LargestMissing(2, 8.0)
    assert found.largest(1, 4, None) == LargestMissing(3, 12.0)
    assert found.largest(1, 2, 0) is None
