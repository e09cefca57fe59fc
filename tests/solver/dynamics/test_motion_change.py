"""What the fit to forces changed, on motions that were changed by hand in a known way."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, csd, freqz

from solver.common.filters import low_pass
from solver.common.typed_json import plain
from solver.dynamics.motion_change import AT_ONCE, BANDS_HZ, band_rms, motion_change, spectra_of
from solver.fitting.fit_result import KinematicsOnly
from solver.fitting.summary import summary
from solver.kinematics.motion import Motion
from tests.addb_viewer.recordings.conftest import skeleton
from tests.conftest import MARKERS_ALONE

__all__ = ["skeleton"]  # a pelvis that moves freely and a leg with a knee

RATE = 100.0
TIMES = np.arange(1000) / RATE
SLOW, USUAL, FAST = 4.0, 6.0, 10.0


def waves(*frequencies, late_s=0.0):
    """One radian each, of whole periods."""
    return sum(np.sin(2 * np.pi * f * (TIMES - late_s)) for f in frequencies)


def changed(skeleton, fitted, markers):
    """Of a leg whose knee moves so; all other coordinates stand still."""
    motions = []
    for knee in (fitted, markers):
        q = np.zeros((len(knee), len(skeleton.dofs)))
        q[:, skeleton.dofs.index("knee")] = knee
        motions.append(Motion(skeleton.dofs, q, RATE))
    return motion_change(skeleton, *motions)


def knee_of(change):
    return next(c for c in change.coordinates if c.name == "knee")


def test_a_change_stands_in_the_band_where_it_is(skeleton):
    markers = waves(1.0)
    wave = np.cos(2 * np.pi * 5.0 * (TIMES + 0.5 / RATE))  # as its mirror image at both ends
    knee = knee_of(changed(skeleton, markers + 0.02 + 0.1 * wave, markers))
    assert knee.offset == pytest.approx(0.02)
    expected = [0.1 / np.sqrt(2) if low == 4.0 else 0.0 for low, _ in BANDS_HZ]
    np.testing.assert_allclose(knee.bands, expected, atol=1e-9)
    assert knee.rms == pytest.approx(np.sqrt(0.02**2 + 0.1**2 / 2))


def test_squares_of_constant_and_bands_add_up_whatever_the_change(skeleton):
    rng = np.random.default_rng(4)
    markers, fitted = rng.standard_normal((2, 237)).cumsum(axis=1)
    knee = knee_of(changed(skeleton, fitted, markers))
    assert knee.offset**2 + np.sum(np.square(knee.bands)) == pytest.approx(knee.rms**2)


def test_a_drift_does_not_look_like_fast_movement():
    drift = np.linspace(0.0, 1.0, 150)[:, None]
    bands = band_rms(drift, RATE, BANDS_HZ)[:, 0]
    assert np.linalg.norm(bands[1:]) < 0.03 * bands[0]  # Fourier's series of a ramp: 0.6


def test_gain_and_phase_of_movement_that_is_lost_and_late(skeleton):
    markers = waves(1.0) + 0.3 * waves(5.0)
    knee = knee_of(changed(skeleton, waves(1.0) + 0.3 * 0.6 * waves(5.0, late_s=0.01), markers))
    slow, _, lost, _, nothing = knee.gains
    assert slow.gain == pytest.approx(1.0, abs=0.03)
    assert lost.gain == pytest.approx(0.6, abs=0.02)
    assert np.degrees(lost.phase_rad) == pytest.approx(-18.0, abs=1.0)  # 10 ms of 200 ms
    assert nothing is None  # the markers do not move there


@pytest.mark.parametrize("windows", [1, AT_ONCE, AT_ONCE + 1, 2 * AT_ONCE + 17])
def test_spectra_of_some_windows_at_a_time_are_those_of_all_at_once(windows):
    rng = np.random.default_rng(1)
    frames = 50 * (windows - 1) + 100 + 31  # some that no window covers
    motion, reference = rng.standard_normal((2, frames, 2)).cumsum(axis=1)
    found = spectra_of(motion, reference, RATE)
    for k in range(2):
        options = {"fs": RATE, "nperseg": 100, "noverlap": 50, "nfft": 800, "detrend": "linear"}
        _, cross = csd(reference[:, k], motion[:, k], **options)
        frequency, own = csd(reference[:, k], reference[:, k], **options)
        np.testing.assert_allclose(found.frequency_Hz, frequency)
        np.testing.assert_allclose(found.own[:, k], own.real, rtol=1e-9)
        np.testing.assert_allclose(found.cross[:, k], cross, rtol=1e-9)


def test_what_is_as_small_as_the_markers_errors_has_no_gain(skeleton):
    markers = 0.3 * waves(1.0) + np.radians(0.1) * waves(5.0)
    assert knee_of(changed(skeleton, 0.3 * waves(1.0), markers)).gains[2] is None


def test_ranges_and_peak_speeds_stand_beside_those_of_the_markers(skeleton):
    markers = waves(1.0)
    knee = knee_of(changed(skeleton, 0.9 * markers, markers))
    assert knee.range / knee.range_of_markers == pytest.approx(0.9, abs=0.001)
    assert knee.peak_speed / knee.peak_speed_of_markers == pytest.approx(0.9, abs=0.001)
    assert knee.peak_speed_of_markers == pytest.approx(2 * np.pi, rel=0.001)


@pytest.mark.parametrize(
    ("movement", "limit"),
    [(waves(0.5), SLOW), (waves(1.0) + 0.06 * waves(5.0), USUAL), (waves(1.4) + 0.2 * waves(5.0), FAST)],
)
def test_the_limit_follows_the_movement(skeleton, movement, limit):
    assert changed(skeleton, movement, movement).limit_Hz == limit


@pytest.mark.parametrize("frames", [1, 2, 4, 30])
def test_trials_of_a_few_frames_are_told_as_far_as_they_go(skeleton, frames):
    markers = waves(1.0)[:frames]
    knee = knee_of(changed(skeleton, markers + 0.1, markers))
    assert knee.rms == pytest.approx(0.1)
    assert (knee.range is None) == (frames < 40)


def test_a_body_that_stands_still_is_no_error(skeleton):
    still = np.zeros(300)
    change = changed(skeleton, still, still)
    assert change.joints_rms_rad == 0.0
    assert change.joints_gain is None


def test_a_bent_real_walk_shows_what_was_lost(recorded_fit):
    """A real walk's markers, bent by a filter of 3 Hz: its gain is the filter's, ranges and peaks shrink."""
    fit = recorded_fit("walk_gait2354_subject01", MARKERS_ALONE)
    (trial,) = fit.trials
    markers = trial.motion
    bent = replace(
        trial,
        motion=replace(markers, q=low_pass(markers.q, markers.rate, 3.0)),
        kinematics_only=KinematicsOnly(markers, trial.marker_errors),
    )
    told = plain(summary(replace(fit, trials=(bent,))))["trials"][0]["change"]
    assert told["limit_hz"] == USUAL
    frequencies, response = freqz(*butter(3, 3.0, fs=markers.rate), worN=2048, fs=markers.rate)
    ends = np.interp([3.0, 7.0], frequencies, np.abs(response) ** 2)
    # windows of a second see a hertz beyond the band of 4 to 6 Hz
    assert ends[1] < told["joints_gain"]["gain"] < ends[0]
    assert told["joints_gain"]["phase_deg"] == pytest.approx(0.0, abs=5.0)
    ankle = next(c for c in told["coordinates"] if c["name"] == "ankle_angle_r")
    assert ankle["peak_speed"] < 0.8 * ankle["peak_speed_of_markers"]
    assert ankle["range"] < ankle["range_of_markers"]
    whole = plain(summary(replace(fit, trials=(replace(bent, motion=markers),))))["trials"][0]["change"]
    assert whole["joints_rms_deg"] == 0.0
    assert whole["joints_gain"]["gain"] == pytest.approx(1.0)
