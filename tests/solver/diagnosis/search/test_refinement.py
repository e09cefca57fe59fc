"""The search for what does not act linearly, and its derivatives."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from solver.diagnosis.causes.clocks import ClockOffset
from solver.diagnosis.causes.effect import Estimate, Signature
from solver.diagnosis.causes.plate_readings import PlateGain
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.refinement import refine
from solver.diagnosis.search.screening import Screen

LATE_S = 0.0137


@pytest.fixture(scope="module")
def late(short_scene, balance_of_scenes) -> Balance:
    """The walk's plates a little late: true(t) = recorded(t + offset), read from a clock that is set back."""
    plates = []
    for p in short_scene.plates:
        slow = replace(p, plate=replace(p.plate, start_time=p.plate.start_time + LATE_S))
        plates.append(replace(slow, wrench_ground=np.nan_to_num(slow.at_frames(slow.loads.wrench_ground))))
    return balance_of_scenes(replace(short_scene, plates=tuple(plates)))


@dataclass(frozen=True)
class Ramp(ClockOffset):
    """A clock with a gain: two η and a column that depends on them."""

    id = "ramp"

    def starts(self, scenes):
        return ((0.0, 0.5), (0.02, 1.5))

    def steps(self):
        return (0.004, 0.1)

    def prior(self, scenes):
        return ((0.01, 0.05), (1.0, 0.4))

    def admissible(self, eta):
        return abs(eta[0]) < 0.1 and 0 <= eta[1] <= 2

    def signature(self, scene, eta):
        made = ClockOffset.signature(self, scene, eta[:1])
        column = (eta[1] ** 2 * scene.plates[0].wrench_ground)[:, :, None]
        return Signature(column, np.array([0.05]), made.fixed)

    def estimates(self, scenes, fit):
        assert fit.x.shape == (1,)
        return {"offset_s": Estimate(fit.eta[0], fit.eta_std[0])}


def first(balance, candidate, noise_scale):
    """Where the search begins."""
    (one,) = Screen(balance, [candidate]).best(noise_scale)
    return balance.spread(one.rows)


def test_a_late_clocks_offset_is_found_within_its_deviation(late):
    candidate = ClockOffset("all")
    noise_scale = late.noise_scales[3]
    start = first(late, candidate, noise_scale)
    solved = late.solve_at([refine(late, start, [], noise_scale)], noise_scale)
    estimate = solved.estimates(0, late.scenes)["offset_s"]
    assert abs(estimate.value - LATE_S) < max(2 * estimate.std, 0.0005)
    assert 0 < estimate.std < 0.002


def test_what_acts_linearly_is_left_alone(late):
    term = late.term(PlateGain("plate_1"), ())
    assert refine(late, term, [], late.noise_scales[0]) is term


def test_tangents_are_derivatives_of_the_prediction_and_eta_keeps_its_place(late):
    """At x of the fit; fixed + T (best − mean) is the prediction at the best η itself."""
    candidate, noise_scale = Ramp("all"), late.noise_scales[3]
    start = first(late, candidate, noise_scale)
    term = refine(late, start, [], noise_scale)
    plain = late.term(candidate, term.eta)
    x, _ = late.solve_at([plain], noise_scale).of(0)
    assert term.tangent_mean == (0.01, 1.0)
    for i in range(2):
        ends = []
        for sign in (1, -1):
            eta = list(term.eta)
            eta[i] += sign * 1e-5
            made = late.term(candidate, tuple(eta))
            ends.append(made.fixed + made.columns @ x)
        numerical = (ends[0] - ends[1]) / 2e-5
        given = term.columns[:, 1 + i]
        assert np.abs(given - numerical).max() < 0.02 * np.abs(numerical).max() + 1e-9
    away = np.array(term.eta) - np.array(term.tangent_mean)
    np.testing.assert_allclose(term.fixed + term.columns[:, 1:] @ away, plain.fixed, atol=1e-8)
    np.testing.assert_allclose(term.prior_std, [0.05, 0.05, 0.4])


def test_with_tangents_the_fit_moves_eta_no_further(late):
    """The search has already been there: value and prior's mean part, value and best eta agree."""
    noise_scale = late.noise_scales[3]
    start = first(late, ClockOffset("all"), noise_scale)
    term = refine(late, start, [], noise_scale)
    value, std = late.solve_at([term], noise_scale).eta(0)
    assert abs(value[0] - term.eta[0]) < 0.5 * std[0]


def test_the_search_stays_within_bounds(late):
    @dataclass(frozen=True)
    class Bounded(ClockOffset):
        def admissible(self, eta):
            return abs(eta[0]) <= 0.008

    term = late.term(Bounded("all"), (0.0,))
    best = refine(late, term, [], late.noise_scales[3])
    assert 0.006 < best.eta[0] <= 0.008
    assert np.isfinite(best.columns).all()
    assert np.abs(best.columns[:, -1]).max() > 0
