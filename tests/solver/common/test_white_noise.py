"""White noise of signals that move, have gaps, or are smooth."""

import numpy as np
import pytest

from solver.common.filters import low_pass
from solver.common.white_noise import FEWEST_DIFFERENCES, ORDER, white_noise, white_noise_together

RATE = 100.0
TIMES = np.arange(600) / RATE


def noisy(std: float, seed: int = 0) -> np.ndarray:
    """Beside ten times as much of a runner's motion in three columns."""
    motion = 10.0 * np.sin(2 * np.pi * 2.8 * TIMES[:, None] + [0.0, 1.0, 2.0])
    return motion + np.random.default_rng(seed).normal(0, std, motion.shape)


def test_noise_is_told_from_motion_that_is_ten_times_larger():
    assert white_noise(noisy(1.0)) == pytest.approx(np.ones(3), rel=0.15)


def test_smooth_and_low_passed_signals_have_none():
    assert white_noise(noisy(0.0)).max() < 0.02
    assert white_noise(low_pass(noisy(1.0), RATE, 10.0)).max() < 0.05


def test_a_few_wild_samples_count_for_nothing():
    wild = noisy(1.0)
    wild[[100, 300, 500]] += 50.0
    assert white_noise(wild) == pytest.approx(white_noise(noisy(1.0)), rel=0.1)


def test_only_stretches_without_a_gap_are_asked():
    gappy = noisy(1.0)
    gappy[100:400, 0] = np.nan
    gappy[::3, 1] = np.nan
    gappy[FEWEST_DIFFERENCES + ORDER - 1 :, 2] = np.nan
    found = white_noise(gappy)
    assert found[0] == pytest.approx(1.0, rel=0.25)
    assert np.isnan(found[1])
    assert np.isnan(found[2])
    assert np.isnan(white_noise(gappy[:ORDER])).all()


def test_columns_together_are_one_column_where_there_is_but_one():
    one = noisy(1.0)[:, :1]
    assert white_noise_together(one) == pytest.approx(white_noise(one)[0])
    assert white_noise_together(noisy(1.0)) == pytest.approx(1.0, rel=0.1)
    assert white_noise_together(one[:ORDER]) == 0.0
