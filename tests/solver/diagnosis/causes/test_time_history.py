import numpy as np
import pytest

from solver.diagnosis.causes.time_history import Stretch, frames_of, join


def stretch(start, end, frames=200):
    return Stretch("walk", start, end, frames, 100.0)


@pytest.mark.parametrize("window", [(40, 110), (0, 70), (130, 200), (0, 200), (50, 56)])
def test_humps_lie_within_and_sum_to_one_in_the_middle(window):
    own = stretch(*window)
    humps = own.humps(0.08)
    assert humps.shape == (200, own.hump_count(0.08))
    outside = np.ones(200, dtype=bool)
    outside[slice(*window)] = False
    assert not humps[outside].any()
    total = humps.sum(axis=1)
    assert total.max() <= 1 + 1e-12
    if own.seconds > 0.3:
        assert total[sum(window) // 2] == pytest.approx(1.0)
    if window[0] == 0:
        assert total[0] == pytest.approx(1.0)
    elif own.seconds > 0.3:
        assert total[window[0]] < 0.25


def test_humps_reproduce_a_smooth_push():
    time_s = np.arange(200) / 100
    push = np.where((time_s > 0.4) & (time_s < 1.1), np.sin(np.pi * (time_s - 0.4) / 0.7) ** 2, 0.0)
    humps = stretch(40, 111).humps(0.08)
    left = push - humps @ np.linalg.lstsq(humps, push, rcond=None)[0]
    assert np.abs(left).max() < 0.02


def test_widened_stays_within_the_trial():
    assert stretch(3, 150).widen(0.1) == stretch(0, 160)
    assert stretch(60, 195).widen(0.1) == stretch(50, 200)


def test_overlapping_stretches_are_joined():
    assert join([stretch(50, 80), stretch(10, 20), stretch(70, 90)]) == (stretch(10, 20), stretch(50, 90))


def test_frames_of_its_own_trial_alone(scene):
    inside = frames_of([Stretch("walk", 3, 6, 251, 100.0), Stretch("other", 8, 9, 251, 100.0)], scene)
    assert np.flatnonzero(inside).tolist() == [3, 4, 5]
