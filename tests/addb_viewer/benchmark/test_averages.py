"""Means, intervals and tests against their definitions."""

from itertools import product

import numpy as np
import pytest

from addb_viewer.benchmark.averages import average, by_person, compared, holm, interval, macro_f1, sign_flip
from addb_viewer.benchmark.scoring import Score


def score(person, trial, mean, frames, metric="grf", *, activity="walk"):
    return Score(person, person, f"{person}/{trial}", activity, metric, mean, frames)


def test_means_over_frames_then_trials_then_persons():
    scores = [
        score("a", "1", 1.0, 10),
        score("a", "1", 4.0, 20, activity="run"),  # trial a/1: (10 + 80) / 30 = 3
        score("a", "2", 5.0, 1),  # person a: 4
        score("b", "1", 10.0, 9),
    ]
    assert by_person(scores, "grf") == {"a": 4.0, "b": 10.0}
    found = average(scores, "grf")
    assert found.mean == 7.0
    assert found.over_trials == 6.0
    assert found.over_frames == (10 + 80 + 5 + 90) / 40
    assert found.over_activities == (4.0 + (3.0 + 10.0) / 2) / 2  # run: a; walk: a has 1 and 5
    assert (found.persons, found.trials, found.frames) == (2, 3, 40)
    assert (found.low, found.high) == (None, None)
    assert average(scores, "grf", "run").mean == 4.0
    assert average(scores, "cop") is None


def test_the_interval_is_that_of_persons_drawn_anew():
    values = np.array([1.0, 2.0, 4.0, 8.0, 16.0])
    means = [np.mean(drawn) for drawn in product(values, repeat=5)]  # all there are
    low, high = interval(values)
    assert low == pytest.approx(np.percentile(means, 2.5), abs=0.15)
    assert high == pytest.approx(np.percentile(means, 97.5), abs=0.15)
    assert interval(values) == (low, high)
    assert interval(values[:4]) == (None, None)
    assert interval(np.full(6, 3.0)) == (3.0, 3.0)


def test_signs_are_counted_out():
    differences = np.array([0.3, 0.5, -0.1, 0.4, 0.6, 0.2])
    means = [np.mean(differences * signs) for signs in product((1, -1), repeat=6)]
    wanted = np.mean(np.abs(means) >= abs(differences.mean()) - 1e-12)
    assert sign_flip(differences) == pytest.approx(wanted)
    assert sign_flip(np.zeros(5)) == 1.0


def test_holm_by_hand():
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.9, 0.8]) == [1.0, 1.0]


def test_only_shared_persons_are_compared():
    own = {"a": 1.0, "b": 2.0, "c": 3.0}
    (found,) = compared("x", {"y": {"b": 3.0, "c": 5.0, "d": 100.0}}, own)
    assert (found.difference, found.persons) == (1.5, 2)


def test_macro_f1_as_scikit_learn_defines_it():
    true = [0] * 5 + [1] * 3 + [3] * 2
    told = [0, 0, 0, 1, 1, 1, 1, 3, 3, 2]
    scores = [
        score(
            "a",
            "1",
            sum((t, p) == (one, other) for t, p in zip(true, told, strict=True)) / 10,
            10,
            f"phase:{one}>{other}",
        )
        for one in range(4)
        for other in range(4)
    ]
    # F1: phase 0: 2·3/(5+3), 1: 2·2/(3+4), 3: 2·1/(2+2)
    assert macro_f1(scores) == pytest.approx((6 / 8 + 4 / 7 + 2 / 4) / 3)
    assert macro_f1([]) is None
