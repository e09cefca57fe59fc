"""Figures remade from sound recordings: which stand, and how scatters are read."""

import numpy as np
import pytest

from benchmarks.sound_recordings import ROBUST, Figure, _between_plates, _scatter, page, usual
from solver.diagnosis.direct_checks.statement import Statement


def test_a_level_stands_within_its_scatter_and_a_scatter_within_half_as_much_again():
    assert Figure("level", -1.9, -2.4, 9, "", within=0.65).stands
    assert not Figure("level", -1.9, -2.6, 9, "", within=0.65).stands
    assert Figure("scatter", 0.03, 0.043, 9, "").stands
    assert not Figure("scatter", 0.03, 0.047, 9, "").stands
    assert not Figure("scatter", 0.03, 0.019, 9, "").stands


def test_a_robust_scatter_is_the_deviation_of_most_whatever_a_few_do():
    found = np.random.default_rng(0).normal(0.0, 0.02, 4001)
    found[:200] = 5.0
    assert _scatter("some", 0.02, [found.tolist()], "").remade == pytest.approx(0.02, rel=0.1)
    assert pytest.approx(1 / 0.6745, rel=1e-3) == ROBUST


def test_each_person_counts_once_and_is_left_out_once():
    people = [[0.01], [0.02] * 50, [0.03], []]
    assert usual(people) == pytest.approx(0.02)
    figure = _scatter("some", 0.03, people, "")
    assert figure.people == 3
    assert figure.left_out == pytest.approx((ROBUST * 0.015, ROBUST * 0.025), rel=0.35)
    assert "3 people" in page([("Some", [figure])])


def test_each_plate_is_held_against_the_others():
    said = Statement("weight", "", {}, {"plate_1_kg": 60.0, "plate_2_kg": 66.0, "plate_3_kg": 60.0})
    assert list(_between_plates(said)) == pytest.approx(np.log([60 / 63, 66 / 60, 60 / 63]))
    assert not list(_between_plates(Statement("lag", "", {}, {"plate_1_kg": 1.0})))


def test_the_page_says_of_each_whether_it_stands():
    told = page([("Some", [Figure("one", 1.0, 1.1, 3, "a"), Figure("two", 1.0, 2.0, 4, "b")])])
    assert "| `one` | stands | 1 | 1.1 | 3 | a |" in told
    assert "| `two` | asks for a look | 1 | 2 | 4 | b |" in told
