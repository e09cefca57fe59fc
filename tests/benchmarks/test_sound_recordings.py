"""Scatters remade from sound recordings: which stand, and how they are read."""

import numpy as np
import pytest

from benchmarks.sound_recordings import ROBUST, Figure, _between_plates, _scatter, usual
from solver.diagnosis.direct_checks.statement import Statement


@pytest.mark.parametrize(
    ("used", "remade", "within", "stands"),
    [
        (-1.9, -2.4, 0.65, True),
        (-1.9, -2.6, 0.65, False),
        (0.03, 0.043, None, True),
        (0.03, 0.047, None, False),
        (0.03, 0.019, None, False),
    ],
)
def test_a_level_stands_within_its_scatter_and_a_scatter_within_half_as_much_again(
    used, remade, within, stands
):
    assert Figure("", used, remade, 9, "", 3, (0.0, 0.0), within).stands is stands


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


def test_each_plate_is_held_against_the_others():
    said = Statement("weight", "", {}, {"plate_1_kg": 60.0, "plate_2_kg": 66.0, "plate_3_kg": 60.0})
    assert list(_between_plates(said)) == pytest.approx(np.log([60 / 63, 66 / 60, 60 / 63]))
    assert not list(_between_plates(Statement("lag", "", {}, {"plate_1_kg": 1.0})))
