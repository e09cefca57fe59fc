import numpy as np
import pytest

from solver.dynamics.weighted_means import windows_over

RATE = 100.0


def test_means_are_hann_weighted_sums_to_one_and_keep_lines():
    windows = windows_over(np.ones(50, dtype=bool), RATE, 0.07, 0.03)
    assert windows.length == 7
    k = np.arange(7)
    hann = np.sin(np.pi * (k + 1) / 8) ** 2
    np.testing.assert_allclose(windows.weights, hann / hann.sum(), atol=1e-15)
    line = 3.0 + 0.5 * np.arange(50)
    np.testing.assert_allclose(windows.means(line), 3.0 + 0.5 * windows.centre, atol=1e-12)


def test_every_column_is_averaged_by_itself():
    values = np.random.default_rng(0).normal(size=(40, 6, 2))
    windows = windows_over(np.ones(40, dtype=bool), RATE, 0.05, 0.04)
    means = windows.means(values)
    assert means.shape == (windows.count, 6, 2)
    by_hand = [np.average(values[s : s + 5, 3, 1], weights=windows.weights) for s in windows.start]
    np.testing.assert_allclose(means[:, 3, 1], by_hand, atol=1e-12)


def test_an_even_length_grows_to_an_odd_one():
    assert windows_over(np.ones(30, dtype=bool), RATE, 0.06, 0.03).length == 7


def test_a_missing_frame_takes_its_windows_away_and_no_others():
    counts = np.ones(60, dtype=bool)
    whole = windows_over(counts, RATE, 0.05, 0.02)
    counts[[20, 41]] = False
    some = windows_over(counts, RATE, 0.05, 0.02)
    touching = [s for s in whole.start if any(s <= t < s + 5 for t in (20, 41))]
    assert touching
    assert set(some.start) == set(whole.start) - set(touching)
    values = np.where(counts, 1.0, np.nan)
    np.testing.assert_allclose(some.means(values), 1.0)


@pytest.mark.parametrize("counts", [np.ones(4, dtype=bool), np.zeros(50, dtype=bool)])
def test_nothing_whole_means_no_window(counts):
    windows = windows_over(counts, RATE, 0.05, 0.02)
    assert windows.count == 0
    assert windows.means(np.ones((len(counts), 6))).shape == (0, 6)
