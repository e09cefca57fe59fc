"""The screening against the balance solved anew for every candidate, by another factorization."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from solver.diagnosis.causes.catalogue import catalogue
from solver.diagnosis.causes.clocks import ClockOffset
from solver.diagnosis.causes.effect import Corrected
from solver.diagnosis.causes.plate_geometry import PlateYaw
from solver.diagnosis.causes.plate_readings import PlateGain
from solver.diagnosis.search.contenders import handicap
from solver.diagnosis.search.screening import Screen, Stack


@pytest.fixture(scope="module")
def wrong(short_scene, drawn, balance_of_scenes):
    """A gain of plate 1, in two trials of which the second is another draw."""
    missing = 0.1 * short_scene.plates[0].wrench_ground
    return balance_of_scenes(drawn(4, missing), drawn(5, missing))


@pytest.fixture(scope="module")
def everything(wrong):
    return [c for c in catalogue(wrong.scenes) if not isinstance(c, Corrected)]


@pytest.fixture(scope="module")
def screen(wrong, everything):
    return Screen(wrong, everything)


@pytest.mark.parametrize(
    "accepted",
    [
        [],
        [PlateGain("plate_1")],
        [PlateGain("plate_1"), ClockOffset("all")],
        [ClockOffset("all"), PlateGain("plate_1"), PlateGain("plate_2")],
    ],
)
def test_each_gain_is_that_of_the_whole_solve(screen, wrong, everything, accepted):
    noise_scale = wrong.noise_scales[4]
    terms = [wrong.term(c, c.starts(wrong.scenes)[0]) for c in accepted]
    without = wrong.solve_at(terms, noise_scale).log_evidence
    screened = list(screen.best(noise_scale, terms))
    assert len({s.rows.candidate.key for s in screened}) > 20
    for one in screened:
        whole = wrong.solve_at([*terms, wrong.spread(one.rows)], noise_scale)
        assert one.gain == pytest.approx(whole.log_evidence - without, abs=1e-5)
        notable = one.rows.candidate.is_notable(whole.estimates(len(terms), wrong.scenes))
        assert one.notable == notable


def test_what_a_set_begins_with_is_kept_for_the_next(screen, wrong, monkeypatch):
    """Beside a further cause only its own columns are multiplied with the catalogue's."""
    noise_scale, asked = wrong.noise_scales[7], []
    times = Stack.times
    monkeypatch.setattr(Stack, "times", lambda s, w: asked.append(w.shape[1:]) or times(s, w))
    first, second = (wrong.term(PlateGain(f"plate_{k}"), ()) for k in (1, 2))
    list(screen.best(noise_scale, [first]))
    asked.clear()
    list(screen.best(noise_scale, [first, second]))
    stacks = asked.count(())  # each with what is left
    assert stacks > 1
    assert [shape for shape in asked if shape] == [(1,)] * stacks


def test_rows_without_a_search_are_always_the_same_term(screen, wrong):
    noise_scale = wrong.noise_scales[4]
    (one,) = (s for s in screen.best(noise_scale) if s.rows.candidate == PlateGain("plate_2"))
    beside = screen.best(noise_scale, [wrong.term(PlateGain("plate_1"), ())])
    (again,) = (s for s in beside if s.rows.candidate == PlateGain("plate_2"))
    term = screen.term(one.rows)
    assert screen.term(again.rows) is term
    np.testing.assert_array_equal(term.columns, wrong.term(PlateGain("plate_2"), ()).columns)


def test_the_best_comes_first_and_what_is_accepted_is_left_out(screen, wrong):
    first = list(screen.best(wrong.noise_scales[4]))
    over_odds = [s.gain - handicap(s.rows.candidate, wrong.settings) for s in first]
    assert over_odds == sorted(over_odds, reverse=True)
    rest = list(screen.best(wrong.noise_scales[4], [wrong.spread(first[0].rows)]))
    assert first[0].rows.candidate.key not in {s.rows.candidate.key for s in rest}
    assert len(rest) == len(first) - 1


def test_of_all_starts_the_best_notable_one_is_taken(wrong):
    clock = ClockOffset("all")
    noise_scale = wrong.noise_scales[4]
    (one,) = Screen(wrong, [clock]).best(noise_scale)
    gains = {}
    for eta in clock.starts(wrong.scenes):
        solved = wrong.solve_at([wrong.term(clock, eta)], noise_scale)
        gains[eta] = clock.is_notable(solved.estimates(0, wrong.scenes)), solved.log_evidence
    assert one.rows.eta == max(gains, key=lambda eta: gains[eta])


def test_rows_of_one_trial_stay_there(wrong):
    (one,) = Screen(wrong, [PlateGain("plate_1")]).best(wrong.noise_scales[4])
    term = wrong.spread(one.rows)
    np.testing.assert_allclose(term.columns, wrong.term(PlateGain("plate_1"), ()).columns)
    assert list(Screen(wrong, [PlateGain("plate_9")]).best(wrong.noise_scales[4])) == []


def test_a_name_ranks_by_its_best_variant(wrong):
    """A variant that describes nothing, in one trial alone say, takes nothing from the other."""

    @dataclass(frozen=True)
    class Weak(PlateGain):
        """The same name, a thousandth of the trace."""

        def signature(self, scene, eta):
            whole = super().signature(scene, eta)
            return None if whole is None else replace(whole, prior_std=1e-3 * whole.prior_std)

    noise_scale = wrong.noise_scales[4]
    variants = [PlateGain("plate_1"), PlateYaw("plate_1"), Weak("plate_1")]
    gains = {type(s.rows.candidate): s.gain for s in Screen(wrong, variants).best(noise_scale)}
    assert gains[PlateGain] > gains[PlateYaw]
    named = list(Screen(wrong, variants).by_name(noise_scale))
    assert [type(s.rows.candidate) for s in named] == [PlateGain, PlateYaw]
