"""The sweep against a slow statement of it."""

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from addb_viewer.benchmark.release_trials import open_for_benchmark
from addb_viewer.benchmark.sweep import draw, sweep, write_csv
from solver.skeleton.pinocchio_model import RigidBodyModel
from tests.addb_viewer.benchmark.simulated_release import GRAVITY, SECONDS


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
