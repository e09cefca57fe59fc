"""Standard deviations of predictors: what they are by slow loops, and that they hold for other persons."""

from dataclasses import replace

import numpy as np
import pytest

from addb_viewer.benchmark.averages import average
from addb_viewer.benchmark.bands import EDGES_N_PER_KG, error_bands
from addb_viewer.benchmark.scoring import scores_of
from addb_viewer.benchmark.task import Predicted
from tests.addb_viewer.benchmark.simulated_release import example

LEVEL, VERTICAL = 0.4, 1.1  # [N/kg] where a foot carries; a tenth of it where it does not


class Noisy:
    """The truth with Gaussian errors of known size."""

    def __init__(self, seed):
        self.rng = np.random.default_rng(seed)

    def answer(self, seen):
        force = example().measured.force
        loaded = force[..., 1:2] > 1.0 * seen.mass_kg
        size = np.where(loaded, 1.0, 0.1) * (LEVEL, VERTICAL, LEVEL) * seen.mass_kg
        return Predicted(force + size * self.rng.standard_normal(force.shape), np.zeros_like(force))


@pytest.fixture(scope="module")
def persons():
    return [replace(example(), person_id=f"lab/p{k}") for k in range(30)]


def test_they_are_the_root_mean_square_errors_of_each_bin(persons):
    first, again, squares = Noisy(1), Noisy(1), {}
    bands = error_bands(lambda one: first.answer(one.seen), persons[:3])
    for one in persons[:3]:
        told = again.answer(one.seen).force
        for t in range(45, one.seen.frames):
            for foot in (0, 1):
                at = sum(told[t, foot, 1] / one.seen.mass_kg > edge for edge in EDGES_N_PER_KG)
                off = (told[t, foot] - one.measured.force[t, foot]) / one.measured.mass_kg
                squares.setdefault((at, one.person_id), []).append(off**2)
    for at in range(len(EDGES_N_PER_KG) + 1):
        own = [np.mean(rows, axis=0) for (k, _), rows in squares.items() if k == at]
        frames = sum(len(rows) for (k, _), rows in squares.items() if k == at)
        if frames >= 20:
            x, y, z = np.mean(own, axis=0)
            np.testing.assert_allclose(bands.sd[at], [np.sqrt((x + z) / 2), np.sqrt(y)])


def test_gaussian_errors_of_other_persons_lie_within_them_as_often_as_is_said(persons):
    first, other, scores = Noisy(2), Noisy(3), []
    bands = error_bands(lambda one: first.answer(one.seen), persons)
    for one in persons:
        told = other.answer(one.seen)
        scores += scores_of(one, replace(told, force_sd=bands.of(told.force, one.seen.mass_kg)))
    assert average(scores, "coverage_50").mean == pytest.approx(0.50, abs=0.06)
    assert average(scores, "coverage_95").mean == pytest.approx(0.95, abs=0.02)


def test_without_measured_forces_there_are_none(persons):
    one = persons[0]
    hidden = replace(one.measured, counts=np.zeros(one.seen.frames, dtype=bool))
    assert error_bands(lambda shown: Noisy(4).answer(shown.seen), [replace(one, measured=hidden)]) is None
