from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, freqz

from solver.capture.capture import Capture, ForcePlate, Markers
from solver.simulate.faults import recorded

RATE = 1000.0


def time_history(times):
    """A force that is smooth and known at any time."""
    return 600 + 300 * np.sin(2 * np.pi * 1.1 * times) + 50 * np.sin(2 * np.pi * 5.3 * times + 1)


@pytest.fixture
def capture():
    times = np.arange(2001) / RATE
    force = np.stack([0.1 * time_history(times), time_history(times), -0.05 * time_history(times)], axis=1)
    cop = np.tile([0.3, 0.0, 0.2], (len(times), 1)) + 0.05 * np.sin(times)[:, None] * np.array([1.0, 0, 1])
    plate = ForcePlate("ground_force_1", force, np.cross(cop, force), cop, RATE)
    markers = Markers(("A",), np.arange(201)[:, None, None] * np.ones((1, 1, 3)) / 100, 100.0)
    return Capture("t", markers, (plate,))


@pytest.mark.parametrize("offset", [0.008, -0.008, 0.0123, -0.0217])
def test_late_forces_show_at_a_time_what_was_true_before(capture, offset):
    late = recorded.late(capture, offset)
    first_frame = late.markers.positions_ground[0, 0, 0]  # the marker tells the true time
    times = first_frame + np.arange(late.plates[0].samples) / RATE
    np.testing.assert_allclose(late.plates[0].force_ground[:, 1], time_history(times - offset), atol=1e-6)
    assert late.plates[0].samples == (late.markers.frames - 1) * 10 + 1
    lost = (201 - late.markers.frames) / 100
    assert abs(offset) <= lost < abs(offset) + 0.0101


@pytest.mark.parametrize("stretch", [0.01, -0.01])
def test_a_stretched_clock_starts_right_and_runs_away(capture, stretch):
    wrong = recorded.stretched(capture, stretch)
    times = np.arange(wrong.plates[0].samples) / RATE
    np.testing.assert_allclose(
        wrong.plates[0].force_ground[:, 1], time_history(times / (1 + stretch)), atol=1e-6
    )
    assert wrong.markers.positions_ground[0, 0, 0] == 0


def test_zeros_stay_zeros_between_the_samples(capture):
    plate = recorded.blanked(capture.plates[0], slice(500, 900))
    wrong = recorded.late(replace(capture, plates=(plate,)), 0.0123).plates[0]
    assert recorded.silent(wrong).sum() == pytest.approx(400, abs=1)


def test_a_low_pass_takes_a_sine_down_as_its_own_response_says_twice(capture):
    times = capture.plates[0].times
    force = np.zeros((len(times), 3))
    force[:, 1] = 500 + 100 * np.sin(2 * np.pi * 8 * times)
    plate = replace(
        capture.plates[0], force_ground=force, moment_ground=np.cross(capture.plates[0].cop_ground, force)
    )
    wrong = recorded.low_passed(replace(capture, plates=(plate,)), 6.0).plates[0]
    b, a = butter(2, 6.0, fs=RATE)
    gain = np.abs(freqz(b, a, worN=[8.0], fs=RATE)[1][0]) ** 2
    middle = slice(500, 1500)
    np.testing.assert_allclose(
        wrong.force_ground[middle, 1], 500 + gain * 100 * np.sin(2 * np.pi * 8 * times[middle]), atol=0.5
    )


def test_a_filtered_plate_still_reads_nothing_without_load(recording):
    wrong = recorded.low_passed(recording.trials[0], 6.0)
    for plate, before in zip(wrong.plates, recording.trials[0].plates, strict=True):
        assert recorded.silent(plate).mean() == pytest.approx(recorded.silent(before).mean(), abs=0.1)
        on = recorded.loaded(plate, 100.0) & recorded.loaded(before, 100.0)
        rough = [np.std(np.diff(p.force_ground[:, 1], 2)[on[1:-1]]) for p in (plate, before)]
        assert rough[0] < 0.1 * rough[1]


def test_cutting_keeps_markers_and_forces_together(capture):
    short = recorded.cut(capture, 20, 120)
    assert short.markers.frames == 100
    np.testing.assert_allclose(short.plates[0].force_ground[0, 1], time_history(0.2))
    np.testing.assert_allclose(short.plates[0].times[[0, -1]], [0.0, 0.99])
