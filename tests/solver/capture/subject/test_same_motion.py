"""One motion exported twice is one trial; two motions of one person are two."""

from dataclasses import replace

import numpy as np
import pytest

from solver.capture.capture import Markers
from solver.capture.subject.same_motion import markers_of, same_motion

SPRINT = "sprint_overground_dorn2012_JA1_9ms/"
TWO_TRIALS = [
    ("opencap_subject4/MarkerData/walking1.trc", "opencap_subject4/MarkerData/walkingTO1.trc"),
    ("exo_apo_gordon/S1_NE21_no_exo/NE21.trc", "exo_apo_gordon/S1_ET21_exo_transparent/ET21.trc"),
    ("opencap_subject4/MarkerData/walking1.trc", "opencap_subject6/walking1.trc"),
    ("opencap_subject4/MarkerData/static1.trc", "opencap_subject6/static1.trc"),
]


def test_a_c3d_and_a_trc_under_other_names_and_axes(real_data):
    trc, c3d = (
        markers_of(real_data / SPRINT / "run0900cms.trc"),
        markers_of(real_data / SPRINT / "JA1Gait35.c3d"),
    )
    assert same_motion(trc, c3d)
    assert same_motion(c3d, trc)


def test_labels_clock_place_and_rate_may_differ(real_data):
    walk = markers_of(real_data / "walk_treadmill_stepwidth/example1/markers.trc")
    quarter_turn = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    other = Markers(
        names=tuple(f"T{k}" for k in range(len(walk.names)))[::-1],
        positions_ground=walk.positions_ground[40:-20:2, ::-1] @ quarter_turn + [3.0, 0.02, 1.0],
        rate=walk.rate / 2,
        start_time=100.0,
    )
    assert same_motion(walk, other)


@pytest.mark.parametrize(("one", "other"), TWO_TRIALS)
def test_like_trials_are_not_one(real_data, one, other):
    assert not same_motion(markers_of(real_data / one), markers_of(real_data / other))


def test_recordings_too_short_or_without_markers_are_never_the_same(real_data):
    walk = markers_of(real_data / TWO_TRIALS[0][0])
    assert not same_motion(walk, replace(walk, positions_ground=walk.positions_ground[:5]))
    assert not same_motion(walk, replace(walk, names=(), positions_ground=walk.positions_ground[:, :0]))
