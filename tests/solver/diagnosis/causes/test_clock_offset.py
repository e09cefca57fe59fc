"""Forces that were recorded late or early."""

import numpy as np
import pytest

from solver.diagnosis.causes.clocks import ClockOffset
from solver.diagnosis.causes.effect import Fitted


@pytest.mark.parametrize("offset_s", [0.0123, -0.04])
def test_the_true_wrench_comes_back(on_one_plate, seen, offset_s):
    late = seen(on_one_plate(lambda times: times - offset_s))
    true = seen(on_one_plate(lambda times: times)).measured_ground
    fixed = ClockOffset("all").signature(late, (offset_s,)).fixed
    inside = slice(20, -20)  # the filter's ends are its own
    left = (late.measured_ground + fixed - true)[inside]
    was = (late.measured_ground - true)[inside]
    assert np.sqrt((left**2).mean()) < 1e-4 * np.sqrt((was**2).mean())


def test_where_nothing_was_recorded_a_shift_explains_nothing(on_one_plate, seen):
    scene = seen(on_one_plate(lambda times: times - 0.1))
    fixed = ClockOffset("all").signature(scene, (0.1,)).fixed
    np.testing.assert_array_equal(fixed[-9:], 0)
    assert np.abs(fixed[:-10]).max() > 1


def test_estimates_bounds_and_the_practical_minimum(on_one_plate, seen):
    scene = seen(on_one_plate(lambda times: times))
    (candidate,) = ClockOffset.candidates([scene])
    nothing = np.zeros(0), np.zeros((0, 0))
    estimate = candidate.estimates([scene], Fitted((0.008,), (0.0004,), *nothing))
    assert (estimate["offset_s"].value, estimate["offset_s"].std) == (0.008, 0.0004)
    assert candidate.is_notable(estimate)
    assert not candidate.is_notable(candidate.estimates([scene], Fitted((0.001,), (0.0004,), *nothing)))
    assert all(candidate.admissible(eta) for eta in candidate.starts([scene]))
    assert not candidate.admissible((0.5,))
    assert ClockOffset.candidates([]) == []


@pytest.mark.parametrize("offset_s", [0.003, -0.006, 0.011, -0.022, 0.045, 0.08, -0.13])
def test_one_start_lies_nearer_to_any_offset_than_no_shift(on_one_plate, seen, offset_s):
    """Candidates are screened at their starts: none of them would do better than nothing otherwise."""
    late = seen(on_one_plate(lambda times: times - offset_s))
    true = seen(on_one_plate(lambda times: times)).measured_ground
    (candidate,) = ClockOffset.candidates([late])
    with_evidence = ~np.any([candidate.unrecorded(late, eta) for eta in candidate.starts([late])], axis=0)
    without = ((late.measured_ground - true)[with_evidence] ** 2).sum()
    left = [
        (((late.measured_ground + candidate.signature(late, eta).fixed) - true)[with_evidence] ** 2).sum()
        for eta in candidate.starts([late])
    ]
    assert min(left) < 0.7 * without
