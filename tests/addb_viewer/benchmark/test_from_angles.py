"""Our own entry against simulated truth."""

import numpy as np
import pytest

from addb_viewer.benchmark.analytical import filtered
from addb_viewer.benchmark.averages import average
from addb_viewer.benchmark.evaluating import Course, evaluate
from addb_viewer.benchmark.from_angles import FromAngles
from addb_viewer.benchmark.metrics import centre_of_pressure
from addb_viewer.benchmark.release_trials import open_for_benchmark
from solver.contact.sole import soles
from solver.skeleton.forward import body_poses
from tests.addb_viewer.benchmark.simulated_release import example


@pytest.fixture(scope="module", params=["walk", "run"])
def answered(request):
    one = example(request.param)
    return one, FromAngles().predict(one.seen)


def test_the_total_is_near_the_truth_and_only_pushes(answered):
    one, foretold = answered
    total = foretold.force.sum(axis=1)
    inner = slice(20, -20)  # the smoothing's own ends
    off = np.linalg.norm(total - one.measured.force.sum(axis=1), axis=1)[inner] / one.seen.mass_kg
    assert off.mean() < {"walk": 0.8, "run": 3.0}[one.measured.activity[0]]  # [N/kg] of 9.8 and up to 25
    assert (total[:, 1] >= 0).all()


def test_nothing_acts_in_flight():
    one = example("run")
    total = np.linalg.norm(FromAngles().predict(one.seen).force.sum(axis=1), axis=1)
    inner = slice(20, -20)
    flies = one.measured.phase[inner] == 0
    assert flies.any()
    assert np.median(total[inner][flies]) == 0.0


def test_pressure_lies_under_the_soles(answered):
    one, foretold = answered
    R, p = body_poses(one.seen.skeleton, foretold.q)
    shown = body_poses(one.seen.skeleton, one.seen.q)[1][:, list(one.seen.feet)]
    for k, sole in enumerate(soles(one.seen.skeleton, one.seen.foot_bodies)):
        corners = sole.corners_ground(R, p)
        height = np.repeat(corners[..., 1].min(axis=1)[:, None], 2, axis=1)
        at, _ = centre_of_pressure(foretold.force, foretold.moment, shown, height)
        alone = np.linalg.norm(foretold.force[:, 1 - k], axis=1) < 1e-6 * np.linalg.norm(
            foretold.force[:, k], axis=1
        )
        loaded = np.isfinite(at[:, k, 0]) & ~alone
        low, high = corners[..., [0, 2]].min(axis=1), corners[..., [0, 2]].max(axis=1)
        inside = (at[:, k][:, [0, 2]] > low - 0.03) & (at[:, k][:, [0, 2]] < high + 0.03)
        assert inside[loaded].all(axis=1).mean() > 0.8


def test_it_is_ahead_of_the_baseline_on_noisy_motion(release, tmp_path):
    source = open_for_benchmark(release)
    ours = evaluate(source, FromAngles(), Course(), tmp_path)
    for cutoff in (6.0, 30.0):
        for rule in ("height", "soles"):
            other = evaluate(source, filtered(cutoff, rule), Course(), tmp_path)
            for metric in ("grf", "grm", "torque"):
                assert average(ours.scores, metric).mean < average(other.scores, metric).mean
