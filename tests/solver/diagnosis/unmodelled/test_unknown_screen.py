"""Unknown forces screened by sparse products, against the balance solved anew with their own rows."""

from dataclasses import replace

import numpy as np
import pytest

from solver.diagnosis.causes.clocks import ClockOffset
from solver.diagnosis.causes.plate_readings import PlateGain
from solver.diagnosis.search.screening import Beside
from solver.diagnosis.unmodelled.remainder import (
    UnknownForce,
    UnknownMoment,
    time_histories_of,
    unknown_forces,
)
from solver.diagnosis.unmodelled.unknown_screen import UnknownScreen

POINTED = UnknownForce("torso", "other", 0.25, (0.05, 0.2, -0.1), (1.0, 0.05, 0.4))
SOME = [
    UnknownForce("hand_l", "walk"),
    UnknownForce("torso", "other", 0.25),
    POINTED,
    replace(POINTED, directions=(0.0, 1.0, 0.0)),
    UnknownMoment("", "walk"),
    UnknownForce("pelvis", "walk", frequency_Hz=2.3),
    replace(POINTED, frequency_Hz=4.0),
    UnknownMoment("", "other", frequency_Hz=3.1),
]


@pytest.fixture(scope="module")
def two(drawn, balance_of_scenes):
    """Two trials of one walk, each with errors of its own."""
    return balance_of_scenes(drawn(4), replace(drawn(5), name="other"))


@pytest.fixture(scope="module")
def unknown(two):
    return UnknownScreen(two)


@pytest.mark.parametrize("accepted", [[], [PlateGain("plate_1"), ClockOffset("all")]])
@pytest.mark.parametrize("candidate", SOME, ids=str)
def test_the_gain_at_the_best_size_is_that_of_the_whole_solve(unknown, two, candidate, accepted):
    noise_scale = two.noise_scales[4]
    terms = [two.term(c, c.starts(two.scenes)[-1]) for c in accepted]
    (one,) = unknown.at([candidate], Beside(terms, noise_scale))
    without = two.solve_at(terms, noise_scale).log_evidence
    by_size = {
        eta: two.solve_at([*terms, two.term(candidate, eta)], noise_scale)
        for eta in candidate.starts(two.scenes)
    }
    best = max(by_size, key=lambda eta: by_size[eta].log_evidence)
    assert one.eta == best
    assert one.gain == pytest.approx(by_size[best].log_evidence - without, abs=1e-6)
    x, _ = by_size[best].of(len(terms))
    np.testing.assert_allclose(one.x, x, atol=1e-6 * np.abs(x).max())


@pytest.mark.parametrize("candidate", SOME, ids=str)
def test_what_one_explains_and_its_time_history_are_those_of_its_own_rows_and_splines(
    unknown, two, candidate
):
    (one,) = unknown.at([candidate], Beside([], two.noise_scales[4]))
    term = two.term(candidate, one.eta)
    np.testing.assert_allclose(unknown.explained(one), term.columns @ one.x, atol=1e-9)
    scene = next(s for s in two.scenes if s.name == candidate.trial)
    time_histories = time_histories_of(scene, candidate.knot_s, candidate.frequency_Hz)
    along = np.flatnonzero(getattr(candidate, "directions", (1, 1, 1)))
    time_history = np.zeros((scene.frames, 3))
    time_history[:, along] = (
        time_histories @ one.x[: len(along) * time_histories.shape[1]].reshape(len(along), -1).T
    )
    np.testing.assert_allclose(unknown.time_history_ground(one), time_history, atol=1e-9)


def test_a_force_along_an_axis_at_the_centre_of_mass_is_part_of_the_free_one(unknown, two):
    """It shares the free force's products, in either order of asking."""
    noise_scale = two.noise_scales[2]
    free = UnknownForce("tibia_r", "walk")
    along = free.along_an_axis(two.scenes[0])[1]
    asked = unknown.at([free, along], Beside([], noise_scale))
    for one in asked:
        (alone,) = UnknownScreen(two).at([one.candidate], Beside([], noise_scale))
        assert alone.eta == one.eta
        assert alone.gain == pytest.approx(one.gain, abs=1e-9)


def test_all_are_told_in_order_and_as_often_as_asked(unknown, two):
    candidates = unknown_forces(two.scenes)
    told = unknown.at([*candidates, *candidates[:3]], Beside([], two.noise_scales[4]))
    assert len(told) == len(candidates) + 3
    gains = [t.gain for t in told]
    assert gains == sorted(gains, reverse=True)
