"""What a short trial is expected to say, against dense Gaussians and draws."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from solver.diagnosis.causes.forces_on_trunk import BodyWeightSupport
from solver.diagnosis.causes.plate_geometry import PlatePosition
from solver.diagnosis.causes.plate_readings import PlateGain
from solver.diagnosis.conclusion import conclude
from solver.diagnosis.deciding.deciding_trial import (
    NOTHING,
    SURE,
    Expected,
    best_of,
    chance_of_sure,
    expected,
    in_full,
    shares_after,
)
from solver.diagnosis.deciding.predicted_trial import (
    Hypothesis,
    nats_between,
    planned_rows,
    posteriors,
    predict,
    rows_of_trial,
)
from solver.diagnosis.deciding.short_trials import AGAIN, STANDING, ShortTrial
from solver.diagnosis.search.balance import Balance, laboratory_errors
from solver.diagnosis.search.selection import select
from solver.dynamics.force_prediction.marker_posterior import trial_posterior
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.fitting.diagnosis_settings import DiagnosisSettings

SETTINGS = replace(
    DiagnosisSettings(), handicaps=(("plate_gain", 0.0), ("counterpart_gain", 0.0)), least_confidence=0.0
)
TEMPER = 3.0


@dataclass(frozen=True)
class Twin(PlateGain):
    """The same under another name."""

    about = replace(PlateGain.about, id="counterpart_gain")


@pytest.fixture(scope="module")
def balance(short_scene, drawn, rows_of):
    return Balance([rows_of(drawn(4, 0.05 * short_scene.plates[1].wrench_ground))], SETTINGS)


def hypotheses(balance, *candidates):
    noise_scale = balance.noise_grid.nearest(1.0, 1.0)
    share = 1.0 / len(candidates)
    return [
        Hypothesis(*c.key, share, TEMPER, balance.solve_at([balance.term(c, ())], noise_scale))
        for c in candidates
    ]


@pytest.fixture(scope="module")
def pair(balance):
    return hypotheses(balance, PlateGain("plate_2"), PlateGain("plate_1"))


@pytest.fixture(scope="module")
def predictions(balance, pair):
    """Of the same once more, with its rows."""
    rows = rows_of_trial(balance, ShortTrial(AGAIN, ()), balance.scenes[0])
    planned = planned_rows(balance, rows, pair[0].solved.noise_scale)
    return rows, [predict(planned, p) for p in posteriors(balance, pair)]


def test_a_prediction_is_the_joint_gaussian_given_the_present_trial(balance, pair, predictions):
    rows, (prediction, _) = predictions
    noise_scale, term = pair[0].solved.noise_scale, pair[0].solved.terms[0]
    own = balance.trials[0]
    before = np.concatenate(
        [
            own.nuisance,
            laboratory_errors([own]),
            noise_scale.slack * own.tissue,
            term.columns * term.prior_std,
        ],
        axis=1,
    )
    again = rows.rows_of(term.candidate, ()).columns * term.prior_std
    after = np.concatenate(
        [rows.nuisance, laboratory_errors([rows]), noise_scale.slack * rows.tissue, again], axis=1
    )
    noise = [t.covariance + noise_scale.scale**2 * t.model_error for t in (own, rows)]
    K11 = before @ before.T + noise[0]
    gain = np.linalg.solve(K11, before @ after.T).T
    mean = gain @ balance.residual
    covariance = after @ after.T + noise[1] - gain @ before @ after.T
    L = np.linalg.cholesky(noise[1])
    assert L @ prediction.mean == pytest.approx(mean, rel=1e-6, abs=1e-6 * np.abs(mean).max())
    assert L @ prediction.covariance @ L.T == pytest.approx(covariance, rel=1e-5, abs=1e-6 * covariance.max())


def test_nats_are_the_mean_log_ratio_of_draws(predictions):
    _, (right, other) = predictions
    draws = np.random.default_rng(0).multivariate_normal(right.mean, right.covariance, size=4000)
    ratio = [multivariate_normal(p.mean, p.covariance).logpdf(draws) for p in (right, other)]
    seen = ratio[0] - ratio[1]
    assert right.nats_against(other) == pytest.approx(seen.mean(), abs=4 * seen.std() / np.sqrt(len(draws)))
    assert right.nats_against(right) == pytest.approx(0.0, abs=1e-6)


def test_a_rival_takes_the_noise_scale_that_suits_it(balance, pair, predictions):
    """At each, Gaussians by rows: of the right one at its own, of the rival at that one."""
    rows, _ = predictions
    near, gaussians = pair[0].solved.noise_scale, {}
    scales = [s for s in balance.noise_scales if s.slack == near.slack and s.scale >= near.scale][::2]
    for scale in scales:
        root = planned_rows(balance, rows, scale).root
        some = [replace(h, solved=balance.solve_at(h.solved.terms, scale)) for h in pair]
        made = [predict(planned_rows(balance, rows, scale), p) for p in posteriors(balance, some)]
        gaussians[scale] = [(root @ p.mean, root @ p.covariance @ root.T) for p in made]
    mean, covariance = gaussians[near][0]
    told = []
    for scale in scales:
        m, V = gaussians[scale][1]
        lost = pair[1].solved.log_evidence - balance.solve_at(pair[1].solved.terms, scale).log_evidence
        spread = np.trace(np.linalg.solve(V, covariance)) - len(m) + (mean - m) @ np.linalg.solve(V, mean - m)
        told.append(0.5 * (spread + np.linalg.slogdet(V)[1] - np.linalg.slogdet(covariance)[1]) + lost)
    nats = nats_between(balance, rows, posteriors(balance, pair), at_own_scales=True)
    assert nats[0, 1] == pytest.approx(min(told), rel=1e-6)
    assert nats[0, 1] <= told[0] + 1e-9


def test_the_best_trial_is_first_and_says_what_to_do(balance, pair):
    promised = expected(balance, posteriors(balance, pair))
    assert [e.chance(pair) for e in promised] == sorted((e.chance(pair) for e in promised), reverse=True)
    best = promised[0]
    odds = np.exp(best.nats[0, 1] / TEMPER)
    assert best.shares[0, 0] / best.shares[0, 1] == pytest.approx(odds)
    assert best.share(pair) == pytest.approx(np.diag(best.shares).mean())
    asked = in_full(balance, posteriors(balance, pair), best_of(promised, pair))
    assert (asked.id, asked.target, asked.other_target) == ("plate_gain", "plate_2", "plate_1")
    assert (asked.trial, asked.odds) == (best.trial.kind.id, pytest.approx(1.0))
    assert asked.odds_after == pytest.approx(np.exp(asked.nats / TEMPER))
    assert best.nats[0, 1] < asked.nats < 4 * best.nats[0, 1]  # all windows say more than some
    assert best.nats[1, 0] < asked.nats_if_other


def test_nats_count_less_the_more_is_explained(balance, pair):
    """As in the diagnosis of both trials: T grows by 0.03 of what the name explains."""
    nothing = Hypothesis(NOTHING, "", 0.0, TEMPER, balance.solve_at([], pair[0].solved.noise_scale))
    nats = np.array([[0.0, 6.0, 100.0], [6.0, 0.0, 100.0], [6.0, 6.0, 0.0]])
    shares = shares_after([*pair, nothing], nats)
    assert shares[0, 0] / shares[0, 1] == pytest.approx(np.exp(6.0 / 6.0))
    assert shares[2, 0] / shares[2, 1] == pytest.approx(1.0)


def test_a_trial_that_says_nothing_leaves_the_name_and_each_rival_their_odds(balance, pair):
    name, alike = (replace(h, share=s) for h, s in zip(pair, (0.6, 0.3), strict=True))
    some = [name, alike, replace(alike, target="plate_3", share=0.1, temper=20.0 * TEMPER)]
    shares = shares_after(some, np.zeros((3, 3)))
    assert shares[0] == pytest.approx([0.6, 0.3, 0.1])
    assert shares[:, 0] / np.diag(shares) == pytest.approx([1.0, 2.0, 6.0])


def test_the_rival_that_is_told_is_one_that_the_trial_parts(balance, pair):
    promised = Expected(
        ShortTrial(AGAIN, ()),
        np.array([[0.0, 0.5, 9.0], [0.5, 0.0, 9.0], [9.0, 9.0, 0.0]]),
        np.array([[0.6, 0.4, 0.0], [0.4, 0.6, 0.0], [0.0, 0.0, 1.0]]),
        np.array([0.0, 0.0, 1.0]),
    )
    name, first = (replace(h, share=share) for h, share in zip(pair, (0.4, 0.35), strict=True))
    some = [name, first, replace(first, target="plate_3", share=0.25)]
    assert best_of([promised], some).other_target == "plate_3"
    alike = replace(promised, nats=np.zeros((3, 3)))
    assert best_of([alike], some).trial is None
    assert best_of([promised], [name, replace(first, share=0.01)]) is None


def test_standing_on_the_plate_tells_its_gain_from_a_support(balance):
    """A support lifts on any plate; a gain is there on its own plate alone, and grows with the load."""
    some = hypotheses(balance, PlateGain("plate_2"), BodyWeightSupport("pelvis"))
    by_kind = {e.trial.kind.id: e.nats[0, 1] for e in expected(balance, posteriors(balance, some))}
    assert by_kind["stand"] > by_kind["again"]


def test_facing_the_other_way_tells_a_plate_s_place_from_the_body_s(balance):
    """In standing, the plate and the trunk's mass in other places look alike; half a turn parts them."""
    some = hypotheses(balance, PlatePosition("plate_2"), PlatePosition("plate_1"))
    by_kind = {e.trial.kind.id: e.nats[0, 1] for e in expected(balance, posteriors(balance, some))}
    assert by_kind["turned"] > by_kind["stand"]


def test_a_scale_tells_gains_and_no_places(balance, pair):
    """The person's true weight says which of two plates reads it right."""
    places = hypotheses(balance, PlatePosition("plate_2"), PlatePosition("plate_1"))
    gains, places = (
        {e.trial.kind.id: e.nats[0, 1] for e in expected(balance, posteriors(balance, some))}
        for some in (pair, places)
    )
    assert gains["scale"] > 2.0
    assert places["scale"] == pytest.approx(0.0, abs=0.05)


def test_markers_leave_less_noise_in_who_stands_than_in_who_walks(short_scene, rows_of):
    """The same markers: smooth motion bears more smoothing."""
    errors = 0.001 * np.random.default_rng(0).standard_normal(short_scene.markers.model_ground.shape)
    markers = replace(short_scene.markers, observed_ground=short_scene.markers.model_ground + errors)
    walks = rows_of(replace(short_scene, markers=markers))
    stands = rows_of_trial(Balance([walks], SETTINGS), ShortTrial(STANDING[0], ("plate_2",)), walks.scene)
    fitted = trial_posterior(
        short_scene.skeleton,
        markers.observed_ground,
        short_scene.motion,
        SETTINGS.markers,
        TrajectorySettings(),
    )
    walking = fitted.wrench_covariance(short_scene.measured_ground, walks.windows)
    variance = [np.diag(C).reshape(-1, 6)[:, :3].mean() for C in (stands.covariance, walking)]
    assert SETTINGS.force_noise_N**2 < variance[0] < SETTINGS.force_noise_N**2 + 0.1 * variance[1]


def test_who_is_seen_late_in_a_recording_stands_with_all_markers(short_scene, rows_of):
    seen, exact = np.arange(short_scene.frames) > 0.6 * short_scene.frames, short_scene.markers.model_ground
    each = (short_scene.counts, exact), (seen, np.where(seen[:, None, None], exact, np.nan))
    whole, late = (
        replace(short_scene, counts=c, markers=replace(short_scene.markers, observed_ground=o))
        for c, o in each
    )
    stands, also = (
        rows_of_trial(Balance([rows_of(s)], SETTINGS), ShortTrial(STANDING[0], ("plate_2",)), s).covariance
        for s in (whole, late)
    )
    np.testing.assert_allclose(also, stands, atol=1e-6 * np.abs(stands).max())


def test_those_that_are_left_out_fare_as_the_rival_that_fares_best(balance, pair):
    some = [replace(h, share=s) for h, s in zip(pair, (0.6, 0.2), strict=True)]
    nothing_said, said = (shares_after(some, np.array([[0.0, n], [n, 0.0]])) for n in (0.0, 50.0))
    assert nothing_said[0, 0] == pytest.approx(0.6)
    assert said[0, 0] == pytest.approx(1.0, abs=1e-3)


def test_the_chance_to_be_sure_is_that_of_draws():
    """The likeliest rival's nats are drawn: N(D, 2 D)."""
    now, nats, temper = np.array([0.5, 0.5]), 8.0, 3.0
    drawn = nats + np.sqrt(2 * nats) * np.random.default_rng(0).standard_normal(200_000)
    share = 1 / (1 + np.exp(-drawn / temper))
    expected_share = 1 / (1 + np.exp(-nats / temper))
    shares = np.array([[expected_share, 1 - expected_share], [1 - expected_share, expected_share]])
    table = np.full((2, 2), nats)
    found = chance_of_sure(shares, table, np.full((2, 2), temper))
    assert found @ now == pytest.approx((share >= SURE).mean(), abs=0.01)


def test_where_nothing_helps_that_is_said(balance):
    twins = hypotheses(balance, PlateGain("plate_2"), Twin("plate_2"))
    asked = best_of(expected(balance, posteriors(balance, twins)), twins)
    assert (asked.trial, asked.other_id) == (None, "counterpart_gain")


def test_only_an_unsure_name_asks_for_a_trial(short_scene, drawn, rows_of):
    rows = rows_of(drawn(4, 0.15 * short_scene.plates[1].wrench_ground, scale=0.5))
    balance = Balance([rows], SETTINGS)
    alone = conclude(balance, select(balance, [PlateGain("plate_2")]))
    assert alone.effects[0].confidence >= SURE
    assert alone.to_be_sure is None
    doubted = conclude(balance, select(balance, [PlateGain("plate_2"), Twin("plate_2")]))
    assert doubted.effects[0].confidence < SURE
    assert doubted.to_be_sure.other_id in {"plate_gain", "counterpart_gain"}
