"""Which frames of long trials teach the inertias."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from solver.dynamics.trajectory.frame_spans import Span, are_long, teaching_spans
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory.trial_data import TrialData
from solver.kinematics.motion import Motion

SETTINGS = TrajectorySettings(whole_frames=1000, inertia_frames=600, stretch_frames=100)


def trial(frames, known=1.0):
    """With forces on the first share of its frames."""
    counts = np.arange(frames) < known * frames
    motion = Motion(("a",), np.zeros((frames, 1)), 100.0)
    return TrialData(np.zeros((frames, 1, 3)), np.zeros((frames, 6)), counts, motion)


def shares(spans, trials):
    return [sum(s.frames for s in spans if s.trial == i) for i in range(len(trials))]


def test_the_border_is_of_all_trials_together():
    assert not are_long([600, 400], SETTINGS)
    assert are_long([600, 401], SETTINGS)


def test_trials_have_even_shares_and_short_ones_leave_theirs_to_others():
    trials = [trial(900), trial(60), trial(3000)]
    assert shares(teaching_spans(trials, [1, 1, 1], SETTINGS), trials) == [270, 60, 270]


def test_a_trial_gives_stretches_from_all_of_its_time_where_forces_are_known():
    (long,) = trials = [trial(12_000)]
    counts = long.counts.copy()
    counts[4000:5500] = False
    spans = teaching_spans([replace(long, counts=counts)], [7], SETTINGS)
    assert shares(spans, trials) == [600]
    assert [s.start // 2000 for s in spans] == [0, 1, 2, 3, 4, 5]
    assert all(s.start % 7 == 0 and counts[s.start : s.end].all() for s in spans)


def test_of_many_trials_those_with_most_known_forces_teach():
    trials = [trial(150, known=0.1 + 0.05 * k) for k in range(18)]
    spans = teaching_spans(trials, [1] * 18, SETTINGS)
    assert sorted({s.trial for s in spans}) == [12, 13, 14, 15, 16, 17]


def test_a_column_that_acts_elsewhere_brings_its_own_stretch():
    columns = np.zeros((12_000, 6, 2))
    columns[:, 1, 0] = 1.0
    columns[1500:1506, 1, 1] = 1.0  # between two stretches
    plain = teaching_spans([trial(12_000)], [1], SETTINGS)
    spans = teaching_spans([replace(trial(12_000), extra_columns_ground=columns)], [1], SETTINGS)
    assert set(spans) - set(plain) == {Span(0, 1450, 1550)}
    assert set(plain) < set(spans)


def test_a_stretch_that_comes_along_does_not_count_frames_twice():
    columns = np.zeros((12_000, 6, 1))
    columns[140:146, 1, 0] = 1.0  # just behind the first stretch
    spans = teaching_spans([replace(trial(12_000), extra_columns_ground=columns)], [1], SETTINGS)
    assert spans[0] == Span(0, 0, 190)
    assert all(before.end < after.start for before, after in pairwise(spans))
