"""Forces on another clock: what lies in the band passes, what lies above does not fold down."""

import numpy as np
import pytest

from solver.capture.resampling import covered, interpolate, resample


def sine(times, frequency):
    return np.sin(2 * np.pi * frequency * times + 0.3)


def amplitude(values, reference):
    return np.sqrt(np.mean(values**2) / np.mean(reference**2))


MIDDLE = slice(20, -20)  # a zero-phase filter knows nothing beyond the ends


@pytest.mark.parametrize("rate", [600, 1000, 1080, 2000])
@pytest.mark.parametrize("frequency", [1.0, 5.0, 15.0])
def test_a_sine_well_inside_the_band_is_unchanged(rate, frequency):
    own = np.arange(3 * rate) / rate
    times = 0.0137 + np.arange(280) / 100
    result = resample(sine(own, frequency)[:, None], rate, 0.0, times)[:, 0]
    np.testing.assert_allclose(result[MIDDLE], sine(times, frequency)[MIDDLE], atol=2e-3)


@pytest.mark.parametrize("frequency", [80, 95, 105, 190, 302])
def test_nothing_folds_down(frequency):
    own = np.arange(6000) / 2000
    times = np.arange(280) / 100
    folded = interpolate(sine(own, frequency), 2000, 0.0, times)
    result = resample(sine(own, frequency), 2000, 0.0, times)
    assert amplitude(folded[MIDDLE], sine(own, frequency)) > 0.2  # what sampling alone would do
    assert amplitude(result[MIDDLE], sine(own, frequency)) < 0.005


def test_one_clock_for_both_changes_nothing():
    values = np.random.default_rng(0).normal(size=(200, 6))
    np.testing.assert_allclose(resample(values, 100, 0.65, 0.65 + np.arange(200) / 100), values, atol=1e-9)


def test_a_slower_recording_is_interpolated_between_its_samples():
    own = np.arange(150) / 50
    times = np.arange(290) / 100
    result = resample(sine(own, 3.0), 50, 0.0, times)
    np.testing.assert_allclose(result[MIDDLE], sine(times, 3.0)[MIDDLE], atol=1e-3)
    np.testing.assert_allclose(result[::2], sine(own, 3.0)[:145], atol=1e-12)


def test_times_that_the_recording_does_not_cover_are_nan():
    times = np.arange(101) / 100
    result = resample(np.ones(401), 1000, 0.3, times)
    np.testing.assert_array_equal(np.isfinite(result), (times > 0.295) & (times < 0.705))
    np.testing.assert_allclose(result[np.isfinite(result)], 1)


@pytest.mark.parametrize(("early", "expected"), [(0.0, True), (0.0012, True), (0.0025, False)])
def test_rounded_times_at_the_ends_still_count_as_covered(early, expected):
    assert covered(1000, 0.5, 1000, np.array([0.5 - early]))[0] == expected


def test_a_single_time():
    assert resample(np.arange(100.0), 100, 0.0, np.array([0.505]))[0] == pytest.approx(50.5)
