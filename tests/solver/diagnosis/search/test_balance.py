"""The balance's algebra against dense Gaussians."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from solver.diagnosis.causes.body_masses import CarriedMass, SegmentMass, SubjectMass
from solver.diagnosis.causes.clocks import ClockOffset
from solver.diagnosis.causes.plate_readings import PlateBias, PlateGain
from solver.diagnosis.noise.noise_grid import MODEL_SCALE_STD, SLACK_STD
from solver.diagnosis.noise.noise_scales import NoiseScale
from solver.diagnosis.search.balance import Balance, laboratory_errors
from solver.diagnosis.search.terms import Term
from solver.fitting.diagnosis_settings import DiagnosisSettings

SETTINGS = DiagnosisSettings()


@pytest.fixture(scope="module")
def balance(drawn, balance_of_scenes) -> Balance:
    return balance_of_scenes(drawn(1))


@pytest.fixture(scope="module")
def terms(balance) -> list[Term]:
    bias = PlateBias.candidates(balance.scenes)[0]
    found = [
        balance.term(PlateGain("plate_1"), ()),
        balance.term(ClockOffset("all"), (0.01,)),
        balance.term(bias, bias.starts(balance.scenes)[0]),
    ]
    assert found[0].columns.shape[1] == 1
    assert found[1].columns.shape[1] == 0
    assert found[1].fixed is not None
    return found


def dense(balance: Balance, noise_scale: NoiseScale) -> np.ndarray:
    """K = markers and plates + inertias + h² (soft tissue, laboratories' errors) + s² model errors."""
    (rows,) = balance.trials
    plates = laboratory_errors([rows])
    sound = rows.covariance + rows.nuisance @ rows.nuisance.T
    soft_tissue = noise_scale.slack**2 * rows.tissue @ rows.tissue.T
    return sound + plates @ plates.T + soft_tissue + noise_scale.scale**2 * rows.model_error


def log_density(balance: Balance, noise_scale: NoiseScale, terms) -> float:
    """Of the residual, parameters integrated out, and the prior of the scales."""
    columns = np.concatenate(
        [t.columns * t.prior_std for t in terms] or [np.zeros((len(balance.residual), 0))], 1
    )
    mean = sum((t.fixed for t in terms if t.fixed is not None), np.zeros(len(balance.residual)))
    K = dense(balance, noise_scale) + columns @ columns.T
    return (
        float(multivariate_normal(mean, K).logpdf(balance.residual))
        - 0.5 * (np.log(noise_scale.scale) / MODEL_SCALE_STD) ** 2
        - 0.5 * (np.log(noise_scale.slack) / SLACK_STD) ** 2
    )


@pytest.mark.parametrize("some", [(), (0,), (1,), (0, 1, 2)])
def test_evidence_is_the_gaussian_density_with_parameters_integrated_out(balance, terms, some):
    """But for (2π)^(n/2), the same at every noise scale and of every hypothesis."""
    chosen = [terms[k] for k in some]
    constant = 0.5 * len(balance.residual) * np.log(2 * np.pi)
    for noise_scale in balance.noise_scales[::4]:
        solved = balance.solve_at(chosen, noise_scale)
        expected = log_density(balance, noise_scale, chosen) + constant
        assert solved.log_evidence == pytest.approx(expected, abs=1e-6)


def test_parameters_and_covariance_are_those_of_the_dense_formula(balance, terms):
    noise_scale = balance.noise_scales[5]
    solved = balance.solve_at(terms, noise_scale)
    S = np.concatenate([t.columns for t in terms], axis=1)
    std = np.concatenate([t.prior_std for t in terms])
    Q = np.linalg.inv(dense(balance, noise_scale))
    covariance = np.linalg.inv(S.T @ Q @ S + np.diag(std**-2.0))
    rest = balance.residual - terms[1].fixed
    np.testing.assert_allclose(solved.x, covariance @ S.T @ Q @ rest, rtol=1e-6, atol=1e-9)
    x, own = solved.of(2)
    np.testing.assert_allclose(x, solved.x[1:])
    largest = 1e-9 * np.abs(covariance).max()
    np.testing.assert_allclose(own, covariance[1:, 1:], rtol=1e-6, atol=largest)
    np.testing.assert_allclose(solved.of(0)[1], covariance[:1, :1], rtol=1e-6, atol=largest)
    assert [part.size for part in solved.of(1)] == [0, 0]
    left = rest - S @ solved.x
    assert solved.left @ solved.left == pytest.approx(left @ Q @ left, rel=1e-8)


def test_rows_are_window_means_about_the_centre_of_mass(short_scene, short_rows):
    """A force through the centre of mass has no moment in any row; elsewhere it has the arm's."""
    rng = np.random.default_rng(0)
    force, arm = rng.normal(0, 100, (short_scene.frames, 3)), np.array([0.1, -0.2, 0.3])
    point = short_scene.com_ground + arm
    rows = short_rows.reduce(np.concatenate([force, np.cross(point, force)], axis=1)).reshape(-1, 6)
    windows = short_rows.windows
    by_hand = np.stack(
        [np.average(force[s : s + windows.length], axis=0, weights=windows.weights) for s in windows.start]
    )
    np.testing.assert_allclose(rows[:, :3], by_hand, atol=1e-9)
    np.testing.assert_allclose(rows[:, 3:], np.cross(arm, by_hand), atol=1e-9)


def test_columns_are_reduced_as_wrenches_are_one_by_one(short_scene, short_rows):
    rng = np.random.default_rng(1)
    columns = rng.normal(0, 50, (short_scene.frames, 6, 4))
    together = short_rows.reduce(columns)
    for k in range(4):
        np.testing.assert_allclose(together[:, k], short_rows.reduce(columns[:, :, k]), atol=1e-10)


def test_a_terms_rows_are_the_candidates_signature(balance, terms):
    (rows,) = balance.trials
    gain = PlateGain("plate_1").signature(rows.scene, ()).columns
    np.testing.assert_allclose(terms[0].columns, rows.reduce(gain), atol=1e-9)
    shifted = ClockOffset("all").signature(rows.scene, (0.01,)).fixed
    np.testing.assert_allclose(terms[1].fixed, rows.reduce(shifted), atol=1e-9)


def test_terms_seen_together_are_those_seen_one_by_one(balance, terms):
    alone = [replace(t, same=object()) for t in terms]
    together = [replace(t, same=object()) for t in terms]
    near, kept, other = balance.noise_scales[5], balance.basis.kept, replace(terms[0], same=object())
    balance.see_ahead(together, [other], near)
    for noise_scale in balance.noise_grid.around(near):
        for one, ahead in zip(alone, together, strict=True):
            assert kept.has("seen", ahead.same, noise_scale)
            assert kept.has("product", ahead.same, other.same, noise_scale)
            np.testing.assert_allclose(
                ahead.seen(noise_scale).scaled, one.seen(noise_scale).scaled, atol=1e-9
            )
            np.testing.assert_allclose(
                ahead.product(other, noise_scale), one.product(other, noise_scale), rtol=1e-9
            )


def test_roots_kept_of_the_terms_before_serve_whatever_comes_after(balance, terms):
    """Each set's root rootᵀ is I + Sᵀ K⁻¹ S, in whatever order sets are fitted."""
    noise_scale = balance.noise_scales[3]
    Q = np.linalg.inv(noise_scale.covariance)
    for some in (terms, terms[::-1], [*terms[1:], terms[0]], terms[:1], terms[:2]):
        S = np.concatenate([t.columns * t.prior_std for t in some], axis=1)
        root = balance.solve_at(some, noise_scale).root
        np.testing.assert_allclose(root @ root.T, np.eye(S.shape[1]) + S.T @ Q @ S, rtol=1e-6, atol=1e-6)


def test_a_target_that_no_trial_has_is_no_term(balance):
    assert balance.term(PlateGain("plate_9"), ()) is None


def test_the_climb_over_the_noise_grid_ends_where_trying_all_noise_scales_does(balance, terms):
    best = balance.solve(terms[:1])
    everywhere = [balance.solve_at(terms[:1], r).log_evidence for r in balance.noise_scales]
    assert best.log_evidence == max(everywhere)
    for noise_scale in balance.noise_scales:
        assert balance.solve(terms[:1], near=noise_scale).noise_scale is best.noise_scale


@pytest.mark.parametrize("slack", [0.5, 1.0])
def test_the_slack_of_soft_tissue_is_found(drawn, rows_of, slack):
    """Drawn at half or all of what is usual, ten times: on average within a quarter."""
    found = []
    for seed in range(10):
        rows = rows_of(drawn(seed))
        slides = np.random.default_rng(50 + seed).normal(size=rows.tissue.shape[1])
        errors = slack * rows.tissue @ slides
        balance = Balance([_with_residual(rows, rows.residual + errors)], SETTINGS)
        found.append(balance.solve([]).noise_scale.slack)
    assert 0.75 < np.exp(np.mean(np.log(found))) / slack < 1.33


def _with_residual(rows, residual):
    other = replace(rows)
    other.__dict__["residual"] = residual  # where the property keeps it
    return other


@pytest.mark.parametrize("scale", [0.5, 2.0])
def test_the_scale_of_errors_is_found(drawn, balance_of_scenes, scale):
    """Within a factor of two: twenty windows and a prior around one."""
    found = [balance_of_scenes(drawn(seed, scale=scale)).solve([]).noise_scale.scale for seed in range(4)]
    assert 0.6 < np.exp(np.mean(np.log(found))) / scale < 1.7


def test_trials_share_inertias_but_no_noise(drawn, rows_of):
    """Two trials of one person in one laboratory: only what body and plates are couples their rows."""
    one, two = rows_of(drawn(1)), rows_of(drawn(2))
    both = Balance([one, two], SETTINGS)
    noise_scale = both.noise_scales[5]
    K = noise_scale.covariance
    n = len(one.residual)
    plates = [laboratory_errors([rows]) for rows in (one, two)]
    shared = one.nuisance @ two.nuisance.T + plates[0] @ plates[1].T
    shared += noise_scale.slack**2 * one.tissue @ two.tissue.T
    np.testing.assert_allclose(K[:n, n:], shared, atol=1e-6)
    np.testing.assert_allclose(K[:n, :n], dense(Balance([one], SETTINGS), noise_scale), atol=1e-6)
    assert both.start.tolist() == [0, n, n + len(two.residual)]


def test_estimates_of_a_gain_come_back(short_scene, balance_of_scenes, drawn):
    """Plate 1 reads 8 % too little: true − recorded = x recorded."""
    plate = short_scene.plates[0].wrench_ground
    balance = balance_of_scenes(drawn(3, 0.08 * plate))
    solved = balance.solve([balance.term(PlateGain("plate_1"), ())])
    estimate = solved.estimates(0, balance.scenes)["gain_error"]
    assert abs(estimate.value - (1 / 1.08 - 1)) < 3 * estimate.std
    assert estimate.std < 0.03


def test_a_scale_reads_masses_and_nothing_else(short_scene, balance_of_scenes):
    balance, skeleton = balance_of_scenes(replace(short_scene, scale_factor=1.05)), short_scene.skeleton
    (torso,) = (body.mass for body in skeleton.bodies if body.name == "torso")
    kg_per_x = [
        (SubjectMass("all"), (), skeleton.mass),
        (SegmentMass("torso"), (0.0,), torso),
        (SegmentMass("torso"), (1.0,), 0.0),
        (CarriedMass("hand_l"), (0.0,), 1.0),
        (CarriedMass("hand_l"), (1.0,), 0.0),
        (CarriedMass("hand_l", "walk"), (), 0.0),
        (PlateGain("plate_1"), (), 0.0),
    ]
    rows = [(balance.term(cause, eta).columns[-6:, 0], kg) for cause, eta, kg in kg_per_x]
    for read, kg in [*rows, (balance.residual[-6:], 0.05 * skeleton.mass)]:
        assert read == pytest.approx([0.0, kg * skeleton.gravity[1], *4 * [0.0]])
    assert balance.basis.of.fixed[-1][1, 1] == pytest.approx((0.002 * short_scene.weight_N) ** 2)


def test_mass_strain_is_the_masss_deviation_when_it_is_fitted_as_a_parameter(short_scene, drawn, rows_of):
    """Instead of among the nuisances: what they have in its direction taken out, a column put in."""
    rows = rows_of(drawn(4, 0.06 * short_scene.required_ground))
    direction = np.linalg.lstsq(rows.nuisance, rows.mass, rcond=None)[0]
    assert np.linalg.norm(direction) == pytest.approx(1.0, rel=1e-4)  # the shortest of many
    without = replace(rows, nuisance=rows.nuisance - np.outer(rows.nuisance @ direction, direction))
    gain = PlateGain("plate_1")
    both, fitted = Balance([rows], SETTINGS), Balance([without], SETTINGS)
    mass = Term(gain, (), None, rows.mass[:, None], np.ones(1))
    for k in (2, 6):
        solved = both.solve_at([both.term(gain, ())], both.noise_scales[k])
        explicit = fitted.solve_at([fitted.term(gain, ()), mass], fitted.noise_scales[k])
        assert both.mass_strain(solved) == pytest.approx(explicit.of(1)[0][0], rel=1e-3)
        assert explicit.log_evidence == pytest.approx(solved.log_evidence, abs=1e-3)
    assert abs(both.mass_strain(both.solve([]))) > 3
