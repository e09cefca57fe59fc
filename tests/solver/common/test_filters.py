"""The low-pass that kinematics and forces share, down to series of a few samples."""

import numpy as np
import pytest

from solver.common.filters import low_pass

RATE, CUTOFF = 200.0, 15.0


@pytest.mark.parametrize("samples", [2, 3, 5, 9, 15, 16, 40])
def test_short_series_are_filtered_too(samples):
    """Noise of 2 from each sample to the next lies at the Nyquist frequency: little is left at any length.

    The ends stay near what was measured there, as they do in long series.
    """
    steady = np.full((samples, 2), [3.0, -700.0])
    noise = np.where(np.arange(samples) % 2, 1.0, -1.0)[:, None]
    np.testing.assert_allclose(low_pass(steady, RATE, CUTOFF), steady, rtol=1e-9)
    left = low_pass(steady + noise, RATE, CUTOFF) - steady
    assert np.abs(np.diff(left, axis=0)).max() < 0.5


@pytest.mark.parametrize("samples", [8, 12, 15])
def test_a_short_piece_is_filtered_nearly_as_within_the_whole(samples):
    rng = np.random.default_rng(2)
    times = np.arange(400) / RATE
    true = np.sin(2 * np.pi * 2 * times)
    noisy = true + rng.normal(0, 0.1, 400)
    filtered, raw = [], []
    for start in range(50, 350, 10):
        piece = slice(start, start + samples)
        filtered.append(low_pass(noisy[piece], RATE, CUTOFF) - true[piece])
        raw.append(noisy[piece] - true[piece])
    assert np.std(filtered) < 0.8 * np.std(raw)


def test_one_sample_and_cutoffs_beyond_nyquist_are_left():
    assert low_pass(np.ones(1), RATE, CUTOFF) == 1.0
    values = np.random.default_rng(0).normal(size=50)
    np.testing.assert_array_equal(low_pass(values, RATE, 100.0), values)
