"""Held-out blocks against the conditional Gaussian written out."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

import solver.diagnosis.held_out_gain
from solver.diagnosis.causes.clocks import ClockOffset
from solver.diagnosis.causes.plate_readings import PlateGain
from solver.diagnosis.held_out_gain import BlockScores, block_scores, blocks, held_out_gain, short_blocks
from solver.diagnosis.search.balance import Balance
from solver.fitting.diagnosis_settings import DiagnosisSettings


@pytest.fixture(scope="module")
def balance(drawn, balance_of_scenes) -> Balance:
    return balance_of_scenes(drawn(1))


@pytest.mark.parametrize("with_terms", [False, True])
def test_scores_are_conditional_densities_and_errors(balance, with_terms):
    terms = [balance.term(PlateGain("plate_1"), ()), balance.term(ClockOffset("all"), (0.02,))]
    terms = terms if with_terms else []
    noise_scale = balance.noise_scales[6]
    K = noise_scale.covariance
    mean = np.zeros(len(K))
    for term in terms:
        S = term.columns * term.prior_std
        K = K + S @ S.T
        mean = mean + (0 if term.fixed is None else term.fixed)
    some = blocks(balance)
    scores = block_scores(balance, terms, noise_scale, some)
    for k, own in enumerate(some):
        others = np.setdiff1d(np.arange(len(K)), own)
        gain = np.linalg.solve(K[np.ix_(others, others)], K[np.ix_(others, own)]).T
        told = mean[own] + gain @ (balance.residual[others] - mean[others])
        covariance = K[np.ix_(own, own)] - gain @ K[np.ix_(others, own)]
        error = balance.residual[own] - told
        np.testing.assert_allclose(scores.error[k].ravel(), error, atol=1e-6 * np.abs(error).max())
        density = multivariate_normal(told, covariance).logpdf(balance.residual[own])
        constant = 0.5 * len(own) * np.log(2 * np.pi)
        assert scores.log_density[k] == pytest.approx(density + constant, abs=1e-6)


def test_short_blocks_score_every_window_but_the_ends_once_between_guards(balance):
    some = short_blocks(balance)
    scored = np.concatenate([own[6:-6] for own in some])
    np.testing.assert_array_equal(scored, 6 + np.arange(len(scored)))
    assert len(balance.residual) - len(scored) < 6 * (2 + len(some[0]) // 6)
    term = balance.term(PlateGain("plate_1"), ())
    whole = block_scores(balance, [term], balance.noise_scales[6], some)
    guarded = block_scores(balance, [term], balance.noise_scales[6], some, guards=1)
    for one, other in zip(whole.error, guarded.error, strict=True):
        np.testing.assert_allclose(other, one[1:-1])


def test_blocks_share_out_all_rows_each_once_and_in_order_of_time(balance):
    some = blocks(balance)
    np.testing.assert_array_equal(np.concatenate(some), np.arange(len(balance.residual)))
    assert all(len(own) % 6 == 0 for own in some)


def test_a_short_trial_has_four_and_a_long_one_half_a_second_each(balance, rows_of, short_scene):
    assert len(blocks(balance)) == 4
    one = rows_of(short_scene)
    settings = DiagnosisSettings()
    two = Balance([one, one], settings)
    own = blocks(two)
    assert len(own) == 8
    assert {int(o[0]) >= len(one.residual) for o in own[:4]} == {False}
    assert {int(o[0]) >= len(one.residual) for o in own[4:]} == {True}


def test_root_mean_squares_are_of_the_vectors_norms_over_windows():
    scores = BlockScores(np.zeros(2), (np.array([[3.0, 0, 4, 0, 2, 0]]), np.array([[0.0, 5, 0, 0, 0, 4]])))
    assert scores.rms() == pytest.approx((5.0, np.sqrt(10)))


def test_what_explains_the_walk_predicts_held_out_blocks_better(short_scene, drawn, balance_of_scenes):
    missing = 0.1 * short_scene.plates[0].wrench_ground
    balance = balance_of_scenes(drawn(5, missing))
    term = balance.term(PlateGain("plate_1"), ())
    some = blocks(balance)
    before = block_scores(balance, [], balance.solve([]).noise_scale, some)
    after = block_scores(balance, [term], balance.solve([term]).noise_scale, some)
    assert after.log_density.sum() > before.log_density.sum() + 5
    assert after.rms()[0] < before.rms()[0]


def test_a_cause_is_not_refused_since_without_it_everything_seems_farther_off(balance):
    """At a scale of 8 nothing is predicted, and so nothing missed: no cause at its own scale comes near."""
    vague, sharp = balance.noise_grid.nearest(8.0, 1.0), balance.noise_grid.nearest(0.18, 0.5)
    term = balance.term(ClockOffset("all"), (0.03,))
    some = blocks(balance)
    density = {
        (len(terms), noise_scale.scale): block_scores(balance, terms, noise_scale, some).log_density.sum()
        for terms, noise_scale in (([], vague), ([], sharp), ([term], sharp))
    }
    gain = held_out_gain(balance, some, balance.solve_at([], vague), balance.solve_at([term], sharp))
    assert density[0, 8.0] != pytest.approx(density[0, 0.18], abs=1.0)
    assert gain.own_scales == pytest.approx(density[1, 0.18] - density[0, 8.0])
    assert gain.same_scales == pytest.approx(density[1, 0.18] - density[0, 0.18])
    assert gain.best == max(gain.own_scales, gain.same_scales)
    at_one_scale = held_out_gain(balance, some, balance.solve_at([], sharp), balance.solve_at([term], sharp))
    assert at_one_scale.own_scales == at_one_scale.same_scales == gain.same_scales


def test_what_others_predict_alone_is_reckoned_once(balance, monkeypatch):
    asked = []

    def counted(balance, terms, *others):
        asked.append(len(terms))
        return block_scores(balance, terms, *others)

    monkeypatch.setattr(solver.diagnosis.held_out_gain, "block_scores", counted)
    noise_scale, some = balance.noise_scales[6], blocks(balance)
    gains = []
    for offset_s in (0.03, 0.03, 0.02):
        term = balance.term(ClockOffset("all"), (offset_s,))
        gain = held_out_gain(
            balance, some, balance.solve_at([], noise_scale), balance.solve_at([term], noise_scale)
        )
        gains.append(gain.own_scales)
    assert asked == [1, 0, 1, 1]
    assert gains[0] == gains[1] != gains[2]
