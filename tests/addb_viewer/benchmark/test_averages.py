"""Means, intervals and tests against their definitions; what is chosen by others; the sweep."""

from itertools import product

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from addb_viewer.benchmark.averages import average, by_person, compared, holm, interval, macro_f1, sign_flip
from addb_viewer.benchmark.release_trials import open_for_benchmark
from addb_viewer.benchmark.results import Result, Terms
from addb_viewer.benchmark.scoring import Score
from addb_viewer.benchmark.sweep import draw, sweep, write_csv
from addb_viewer.benchmark.tables import chosen_by_others
from solver.skeleton.pinocchio_model import RigidBodyModel
from tests.addb_viewer.benchmark.simulated_release import GRAVITY, SECONDS


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


TERMS = Terms("r", "1", "s", ("test",), "unfitted", "scored")


def result(name, **errors):
    """Errors by person and activity, as a_walk=1.0; `cop` is 100 times as much."""
    scores = []
    for key, error in errors.items():
        person, activity = key.split("_")
        for metric, factor in (("grf", 1), ("cop", 100)):
            scores.append(Score(person, person, f"{person}/{activity}", activity, metric, factor * error, 10))
    return Result(name, TERMS, tuple(scores), 1.0)


def test_nobodys_own_error_has_a_say():
    low = result("low", a_walk=9.0, b_walk=1.0, c_walk=1.0, a_run=5.0, b_run=5.0)
    high = result("high", a_walk=2.0, b_walk=3.0, c_walk=3.0, a_run=4.0, b_run=9.0)
    both = chosen_by_others([low, high], "best", "grf")
    # walk: for a others say low (1 against 3); for b and c high (low: 5, high: 2.5)
    assert by_person(both.scores, "grf", "walk") == {"a": 9.0, "b": 3.0, "c": 3.0}
    # run: for a, b says low (5 against 9); for b, a says high (5 against 4)
    assert by_person(both.scores, "grf", "run") == {"a": 5.0, "b": 9.0}
    assert by_person(both.scores, "cop", "walk") == {"a": 900.0, "b": 300.0, "c": 300.0}
    assert (both.name, both.seconds) == ("best", 2.0)


def test_where_nobody_else_does_it_all_activities_choose():
    low = result("low", a_walk=1.0, b_walk=1.0, b_jump=8.0)
    high = result("high", a_walk=2.0, b_walk=2.0, b_jump=7.0)
    both = chosen_by_others([low, high], "best", "grf")
    assert by_person(both.scores, "grf", "jump") == {"b": 8.0}


@pytest.fixture(scope="module")
def trials(release):
    return open_for_benchmark(release).trials(frozenset({"lab/p4", "lab/p5"}))


def test_against_filters_by_hand(trials):
    points = {(p.activity, p.cutoff_Hz): p for p in sweep(trials, (6.0, None))}
    errors = {6.0: [], None: []}
    for example in trials:
        q, rate = example.seen.q, example.seen.rate
        velocity = np.gradient(q, 1 / rate, axis=0)
        acceleration = np.empty_like(q)
        acceleration[1:-1] = np.diff(q, 2, axis=0) * rate**2
        acceleration[[0, -1]], velocity[[0, -1]] = acceleration[[1, -2]], velocity[[1, -2]]
        com = RigidBodyModel(example.seen.skeleton).centre_of_mass_acceleration(q, velocity, acceleration)
        off = com - GRAVITY - example.measured.force.sum(axis=1) / example.measured.mass_kg
        errors[None].append(np.sqrt(np.mean(off**2)))
        # The filter is linear: the difference of filtered series is the filtered difference.
        smooth = sosfiltfilt(butter(3, 6.0, fs=rate, output="sos"), off, axis=0, padlen=15)
        errors[6.0].append(np.sqrt(np.mean(smooth**2)))
    for cutoff, values in errors.items():
        assert points["all", cutoff].rmse == pytest.approx(np.mean(values), rel=1e-6)
        assert (points["all", cutoff].trials, points["all", cutoff].persons) == (3, 2)
    assert points["run", None].trials == 1
    assert points["walk", None].trials == 2


def test_it_falls_with_the_cutoff_and_is_drawn(trials, tmp_path):
    points = sweep(trials)
    # Where the filter's own time is a small part of the stretch; below, its ends weigh more than its middle.
    curve = [p.rmse for p in points if p.activity == "all" and (p.cutoff_Hz or np.inf) * SECONDS > 15]
    assert curve == sorted(curve)
    assert curve[-1] > 1.5 * curve[0]
    write_csv(points, tmp_path / "sweep.csv")
    assert len((tmp_path / "sweep.csv").read_text().splitlines()) == 1 + 3 * 11
    svg, png = draw(points, tmp_path / "sweep")
    assert svg.stat().st_size > 10_000
    assert png.stat().st_size > 10_000
