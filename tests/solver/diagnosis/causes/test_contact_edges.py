"""How steeply forces fall off where contacts begin and end: sound ones, smoothed ones, and ends of files."""

import numpy as np
import pytest
from scipy.signal import butter, filtfilt, freqz

from benchmarks.faults.editor.clocks import smoothed
from benchmarks.faults.editor.sources import SOURCES
from solver.diagnosis.causes.contact_edges import fall_off, filtered_nats, log_cutoff, usual_fall_off
from solver.diagnosis.causes.filter_mismatch import FilterMismatch

RATE = 500.0


def contacts(rise_s=0.05):
    """Two stances of 0.6 s on one plate."""
    t = np.arange(0, 3, 1 / RATE)
    force = np.zeros(len(t))
    for start in (0.6, 1.8):
        force += 800 * np.clip((t - start) / rise_s, 0, 1) * np.clip((start + 0.6 - t) / rise_s, 0, 1)
    return force


@pytest.mark.parametrize("cutoff_Hz", [5.0, 8.0])
def test_a_filter_steepens_it_by_its_own_gains(cutoff_Hz):
    """Those that SciPy has of a single pass, squared; windows see a few Hz about 8 and 20."""
    b, a = butter(2, cutoff_Hz, fs=RATE)
    sound, smooth = contacts(), filtfilt(b, a, contacts())
    _, gain = freqz(b, a, [8.0, 20.0], fs=RATE)
    steeper = usual_fall_off(fall_off(smooth, RATE)) - usual_fall_off(fall_off(sound, RATE))
    assert steeper == pytest.approx(2 * np.log(abs(gain[1]) / abs(gain[0])), rel=0.2)


def test_a_load_that_is_cut_at_the_ends_of_the_file_is_no_edge():
    force = contacts()[int(0.9 * RATE) : int(2.1 * RATE)]  # from one stance into the next
    assert len(fall_off(force, RATE)) == 2
    assert fall_off(np.full(1500, 800.0), RATE) == []
    assert usual_fall_off([]) is None


def test_slow_recordings_and_short_ones_tell_nothing():
    assert fall_off(contacts(), 40.0) == []
    assert fall_off(contacts()[:60], RATE) == []


def median_of(recording):
    edges = [e for t in recording.trials for p in t.plates for e in fall_off(p.force[:, 1], t.force_rate)]
    return usual_fall_off(edges)


@pytest.fixture(scope="module")
def moving(real_data):
    return [s.read(real_data) for s in SOURCES if s.activity in ("walk", "run", "jump")]


def test_sound_recordings_speak_against_a_filter_and_smoothed_ones_for_it(moving):
    """Sound ones were looked at when the figures were set; smoothed ones were made by another program."""
    rng = np.random.default_rng(0)
    spoken, told = [], []
    for recording in moving:
        assert filtered_nats(median_of(recording)) < 0
        edited, _ = smoothed(5.0)(recording, rng)
        spoken.append(filtered_nats(median_of(edited)))
        told.append(log_cutoff(median_of(edited)))
    assert min(spoken) > 0
    assert np.median(spoken) > 5
    log_Hz, std = np.array(told).T
    away = (log_Hz - np.log(5.0 / (np.sqrt(2) - 1) ** 0.25)) / std
    assert np.abs(away).max() < 2.5
    assert abs(away.mean()) < 1.0


def test_a_fall_that_speaks_for_no_filter_tells_no_cutoff():
    assert log_cutoff(-1.9) is None
    assert log_cutoff(-7.0)[0] < log_cutoff(-5.0)[0]


def test_it_is_evidence_for_the_filter_and_none_against_it():
    assert FilterMismatch("all", fall=-6.0).seen_elsewhere > 5
    assert FilterMismatch("all", fall=-1.5).seen_elsewhere == 0
    assert FilterMismatch("all").seen_elsewhere == 0
