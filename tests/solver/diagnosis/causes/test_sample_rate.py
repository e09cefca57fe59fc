"""Forces that were sampled at another rate than the file says."""

import numpy as np
import pytest

from solver.diagnosis.causes.clocks import SampleRate
from solver.diagnosis.causes.effect import Fitted


@pytest.mark.parametrize("stretch", [0.01, -0.02])
def test_the_true_wrench_comes_back(on_one_plate, seen, stretch):
    """But for the filter, whose cutoff is stretched, too."""
    drifting = seen(on_one_plate(lambda times: times / (1 + stretch)))
    true = seen(on_one_plate(lambda times: times)).measured_ground
    fixed = SampleRate("all").signature(drifting, (stretch,)).fixed
    inside = slice(20, -20)
    left = (drifting.measured_ground + fixed - true)[inside]
    was = (drifting.measured_ground - true)[inside]
    assert np.sqrt((left**2).mean()) < 0.02 * np.sqrt((was**2).mean())


def test_where_nothing_was_recorded_a_stretch_explains_nothing(on_one_plate, seen):
    scene = seen(on_one_plate(lambda times: times / 1.04))
    fixed = SampleRate("all").signature(scene, (0.04,)).fixed
    unrecorded = 1.04 * scene.times > scene.times[-1] + 0.001
    assert unrecorded.sum() > 5
    np.testing.assert_array_equal(fixed[unrecorded], 0)
    assert np.abs(fixed[~unrecorded]).max() > 1


def test_starts_lie_as_close_as_the_longest_trial_needs(on_one_plate, seen):
    scene = seen(on_one_plate(lambda times: times))
    (candidate,) = SampleRate.candidates([scene])
    starts = np.array(candidate.starts([scene]))[:, 0]
    assert np.diff(starts).max() * scene.times[-1] <= 0.06
    assert starts.min() <= -0.02
    assert starts.max() >= 0.02
    assert 0.0 in starts
    assert all(candidate.admissible(eta) for eta in candidate.starts([scene]))
    assert not candidate.admissible((0.1,))


def test_estimates_and_the_practical_minimum():
    candidate = SampleRate("all")
    nothing = np.zeros(0), np.zeros((0, 0))
    estimate = candidate.estimates([], Fitted((-0.01,), (0.001,), *nothing))
    assert (estimate["stretch"].value, estimate["stretch"].std) == (-0.01, 0.001)
    assert candidate.is_notable(estimate)
    assert not candidate.is_notable(candidate.estimates([], Fitted((0.001,), (0.001,), *nothing)))
