import numpy as np
import pytest

from annotations.agreement import agreement


def labels(*runs, frames=10):
    missing = np.zeros((frames, 1), dtype=bool)
    for start, end in runs:
        missing[start:end] = True
    return missing


def test_the_worked_example_of_cohens_kappa():
    # 50 cases: both yes 20, first only 5, second only 10, both no 15; 0.7 observed, 0.5 by chance
    one = labels((0, 25), frames=50)
    other = labels((0, 20), (25, 35), frames=50)
    found = agreement(one, other)
    assert found.same == pytest.approx(0.7)
    assert found.kappa == pytest.approx(0.4)
    assert found.differ == ((20, 35),)


def test_the_same_labels_agree_wholly_and_opposite_ones_are_worse_than_chance():
    one = labels((2, 7))
    assert agreement(one, one).kappa == 1
    assert agreement(one, one).differ == ()
    assert agreement(one, ~one).kappa == pytest.approx(-1)


def test_one_label_throughout_says_nothing():
    found = agreement(labels(), labels())
    assert np.isnan(found.kappa)
    assert found.same == 1


def test_frames_differ_when_one_foot_does():
    one, other = np.zeros((10, 2), dtype=bool), np.zeros((10, 2), dtype=bool)
    one[3:5, 0] = other[5:6, 1] = other[8, :] = True
    assert agreement(one, other).differ == ((3, 6), (8, 9))


def test_kappa_of_several_labels_against_its_table():
    # Fleiss, Cohen & Everitt 1969 style 3x3 table: rows the first reviewer's, columns the second's
    table = np.array([[44, 5, 1], [7, 20, 3], [9, 5, 6]])
    names = np.array(["walk", "run", "squat"])
    one = np.repeat(names[np.repeat(range(3), 3)], table.ravel())[:, None]
    other = np.repeat(names[np.tile(range(3), 3)], table.ravel())[:, None]
    observed = np.trace(table) / table.sum()
    expected = (table.sum(axis=0) @ table.sum(axis=1)) / table.sum() ** 2
    assert (observed, expected) == (pytest.approx(0.70), pytest.approx(0.41))
    assert agreement(one, other).kappa == pytest.approx((0.70 - 0.41) / (1 - 0.41))
