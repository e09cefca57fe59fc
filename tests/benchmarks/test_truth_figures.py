"""Figures of the bench of truth against signals whose lag, gain and errors are known by construction."""

import numpy as np
import pytest
from scipy.signal import butter, freqz

from benchmarks.truth.figures import figures, gains, inner, lag_ms
from benchmarks.truth.tables import best_cutoff, peak_percent, pooled, range_percent
from benchmarks.truth.ways import OURS, TimeHistory, at_cutoff, low_passed_markers, time_history_of
from solver.common.filters import low_pass
from solver.kinematics.motion import Motion

RATE = 100.0
DOFS = ("hip_flexion_r", "hip_flexion_l", "knee_angle_r")
TIMES = np.arange(400) / RATE


def time_history(angle, torque=None):
    return time_history_of(Motion(DOFS, angle, RATE), torque)


def swing(late_s=0.0):
    t = TIMES - late_s
    one = 0.4 * np.sin(2 * np.pi * t) + 0.1 * np.sin(2 * np.pi * 2.3 * t + 1)
    return np.stack([one, -one, 0.5 * one + 0.3], axis=1)


@pytest.mark.parametrize("late_ms", [-23.0, 0.0, 4.0, 17.5])
def test_a_lag_is_found_between_frames_with_its_sign(late_ms):
    found = lag_ms(swing(late_ms / 1000)[:, 0], swing()[:, 0], RATE)
    assert found == pytest.approx(late_ms, abs=0.3)


def test_curves_that_are_not_alike_have_no_lag():
    noise = np.random.default_rng(2).standard_normal((2, 400))
    assert lag_ms(noise[0], noise[1], RATE) is None
    assert lag_ms(np.zeros(400), noise[1], RATE) is None


def test_errors_ranges_and_peaks_in_their_units():
    truth = time_history(swing(), 100 * swing())
    off = time_history(1.1 * swing() + np.radians(2.0), 90 * swing())
    counts = np.zeros(400, dtype=bool)
    counts[100:300] = True
    found = figures(off, truth, counts)
    hip = found["angle"]["hip_flexion_r"]
    kept = inner(400, RATE)
    degrees = np.degrees(swing()[kept, 0])
    assert hip["range"] == pytest.approx(np.ptp(degrees))
    assert hip["range_excess"] == pytest.approx(0.1 * np.ptp(degrees))
    assert hip["rms"] == pytest.approx(np.sqrt(np.mean((0.1 * degrees + 2.0) ** 2)))
    assert hip["rms_without_offset"] == pytest.approx(0.1 * np.std(degrees))
    torque = found["torque"]["knee_angle_r"]
    assert torque["peak"] == pytest.approx(np.abs(100 * swing()[100:300, 2]).max())
    assert torque["peak_excess"] == pytest.approx(-0.1 * torque["peak"])
    runs = [{"ways": {OURS: found}}]
    assert peak_percent(runs, OURS, "torque", DOFS) == pytest.approx(-10.0)
    assert range_percent(runs, OURS, DOFS) == pytest.approx(10.0)


def test_frames_without_truth_and_ends_do_not_count():
    angle = swing()
    truth = time_history(angle)
    silent = np.where((np.arange(400) < 250)[:, None], angle, np.nan)
    spoilt = angle.copy()
    spoilt[:5] += 1.0
    spoilt[260:] += 1.0
    known = TimeHistory(DOFS, RATE, silent, truth.speed, truth.acceleration)
    found = figures(time_history(spoilt), known, np.ones(400, dtype=bool))
    assert found["angle"]["hip_flexion_l"]["worst"] < 1e-12
    assert "torque" not in found


def test_gain_and_phase_are_those_of_a_filter_whose_response_is_known():
    """Zero-lag Butterworth on noise: the square of a single pass's response, no phase; a delay turns it."""
    noise = np.random.default_rng(5).standard_normal((6000, 3))
    smooth = low_pass(noise, RATE, 6.0, 3)
    table = gains(time_history(smooth), time_history(noise))["hip"]
    design = butter(3, 6.0, fs=RATE)
    for band in table:
        inside = np.linspace(band["low_Hz"] + 0.25, band["high_Hz"] - 0.25, 50)
        expected = np.mean(np.abs(freqz(*design, worN=inside, fs=RATE)[1]) ** 2)
        assert band["gain"] == pytest.approx(expected, abs=0.05)
        if expected > 0.3:
            assert abs(band["phase_deg"]) < 3.0
    late = np.roll(noise, 1, axis=0)
    for band in gains(time_history(late), time_history(noise))["knee"]:
        middle = 0.5 * (band["low_Hz"] + band["high_Hz"])
        assert band["phase_deg"] == pytest.approx(-360 * middle / RATE, abs=6.0)
        assert band["gain"] == pytest.approx(1.0, abs=0.05)


def test_the_best_cutoff_is_the_one_nearest_to_the_truth():
    truth = time_history(swing())
    noisy = swing() + 0.02 * np.random.default_rng(1).standard_normal((400, 3))
    counts = np.ones(400, dtype=bool)
    ways = {
        at_cutoff(hz): figures(time_history(low_pass(noisy, RATE, hz, 3)), truth, counts)
        for hz in (3.0, 6.0, 12.0, 30.0)
    }
    hertz, error = best_cutoff([{"ways": ways}], "acceleration", DOFS)
    each = {
        hz: pooled([{"ways": ways}], at_cutoff(hz), "acceleration", DOFS) for hz in (3.0, 6.0, 12.0, 30.0)
    }
    assert error == min(each.values())
    assert each[hertz] == error
    assert hertz < 30.0


def test_a_laboratory_fills_short_gaps_and_leaves_long_ones():
    path = np.stack([np.sin(2 * np.pi * TIMES), np.cos(2 * np.pi * TIMES), TIMES], axis=1)[:, None]
    holed = path.copy()
    holed[100:110] = np.nan
    holed[200:260] = np.nan
    holed[:20] = np.nan
    smooth = low_passed_markers(holed, RATE, 6.0)
    seen = np.isfinite(smooth).all(axis=2)[:, 0]
    assert seen[100:110].all()
    assert not seen[201:259].any()
    assert not seen[:20].any()
    assert np.abs(smooth - path)[30:190].max() < 0.01
