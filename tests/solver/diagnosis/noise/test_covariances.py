"""K as it is and in the trials' bases, against dense matrices."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import block_diag

import solver.diagnosis.search.balance
from solver.diagnosis.causes.body_masses import CarriedMass
from solver.diagnosis.causes.clocks import ClockOffset
from solver.diagnosis.causes.plate_readings import PlateGain
from solver.diagnosis.held_out_gain import block_scores, blocks
from solver.diagnosis.noise.noise_scales import Basis, Covariances, TrialsBasis
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.screening import Beside, Screen
from solver.diagnosis.unmodelled.remainder import unknown_forces
from solver.diagnosis.unmodelled.unknown_screen import UnknownScreen
from solver.fitting.diagnosis_settings import DiagnosisSettings

SIZES = (9, 14, 5)
SCALES = ((0.09, 0.5), (1.0, 1.0), (8.0, 0.7))
SECOND = slice(9, 23)


@pytest.fixture(scope="module")
def of() -> Covariances:
    """Three trials; more shared columns than rows, some of them next to nothing."""
    rng = np.random.default_rng(3)

    def positive(rows: int, least: float) -> np.ndarray:
        A = rng.normal(size=(rows, rows))
        return A @ A.T + least * np.eye(rows)

    return Covariances(
        rng.normal(0, 3, sum(SIZES)),
        tuple(positive(n, 0.5) for n in SIZES),
        tuple(positive(n, 1e-9) for n in SIZES),
        rng.normal(size=(sum(SIZES), 30)) * np.geomspace(1e-7, 30, 30),
        rng.normal(size=(sum(SIZES), 4)),
    )


def dense(of: Covariances, scale: float, slack: float) -> np.ndarray:
    """K, stated once more."""
    own = block_diag(*(C + scale**2 * M for C, M in zip(of.fixed, of.model, strict=True)))
    return own + of.shared @ of.shared.T + slack**2 * of.tissue @ of.tissue.T


@pytest.mark.parametrize("basis", [Basis, TrialsBasis])
@pytest.mark.parametrize(("scale", "slack"), SCALES)
def test_a_noise_scale_is_the_dense_matrix(of, basis, scale, slack):
    noise_scale = basis(of).noise_scale(scale, slack, -1.5)
    K = dense(of, scale, slack)
    Q = np.linalg.inv(K)
    columns = np.random.default_rng(4).normal(size=(len(K), 3))
    turned = noise_scale.basis.transform(columns)
    whitened = noise_scale.whiten(turned)
    np.testing.assert_allclose(whitened.T @ whitened, columns.T @ Q @ columns, rtol=1e-8, atol=1e-10)
    on_residual = noise_scale.seen(turned, slice(0, len(K))).times(noise_scale.seen_residual)[:, 0]
    np.testing.assert_allclose(on_residual, columns.T @ Q @ of.residual, rtol=1e-8, atol=1e-10)
    assert noise_scale.square == pytest.approx(of.residual @ Q @ of.residual, rel=1e-9)
    assert noise_scale.constant == pytest.approx(-1.5 - 0.5 * np.linalg.slogdet(K)[1], abs=1e-8)
    np.testing.assert_allclose(noise_scale.covariance, K, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(of.variance(scale, slack), np.diag(K), rtol=1e-12)
    np.testing.assert_allclose(
        noise_scale.basis.rows(noise_scale.times_precision(turned)), Q @ columns, rtol=1e-7, atol=1e-9
    )
    some = slice(12, 20)
    np.testing.assert_allclose(noise_scale.precision_at(some), Q[some, some], rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("basis", [Basis, TrialsBasis])
@pytest.mark.parametrize("span", [SECOND, slice(0, 23), slice(9, 28)])
def test_columns_of_some_trials_are_weighted_there(of, basis, span):
    noise_scale = basis(of).noise_scale(0.7, 1.0, 0.0)
    Q = np.linalg.inv(dense(of, 0.7, 1.0))
    columns = np.random.default_rng(5).normal(size=(span.stop - span.start, 2))
    turned = noise_scale.basis.transform(columns, span)
    product = turned.T @ noise_scale.times_precision(turned, span)
    np.testing.assert_allclose(product, columns.T @ Q[span, span] @ columns, rtol=1e-8)


@pytest.mark.parametrize("basis", [Basis, TrialsBasis])
@pytest.mark.parametrize(
    "spans",
    [(SECOND, SECOND), (SECOND, slice(0, 9)), (slice(0, 23), slice(9, 28)), (slice(23, 28), slice(0, 28))],
)
def test_columns_of_some_trials_meet_those_of_others(of, basis, spans):
    noise_scale = basis(of).noise_scale(0.7, 0.5, 0.0)
    Q = np.linalg.inv(dense(of, 0.7, 0.5))
    rng = np.random.default_rng(6)
    columns = [rng.normal(size=(span.stop - span.start, n)) for n, span in zip((2, 3), spans, strict=True)]
    one, other = (
        noise_scale.seen(noise_scale.basis.transform(c, span), span)
        for c, span in zip(columns, spans, strict=True)
    )
    expected = columns[0].T @ Q[spans[0], spans[1]] @ columns[1]
    np.testing.assert_allclose(one.times(other), expected, rtol=1e-8, atol=1e-9)


@pytest.fixture(scope="module")
def both(short_scene, drawn, rows_of):
    """One balance in its rows, and in its trials' bases."""
    missing = 0.1 * short_scene.plates[0].wrench_ground
    trials = [rows_of(drawn(4, missing)), rows_of(replace(drawn(5, missing), name="other"))]
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(solver.diagnosis.search.balance, "MANY_ROWS", 0)
        turned = Balance(trials, DiagnosisSettings())
    plain = Balance(trials, DiagnosisSettings())
    assert type(turned.basis) is TrialsBasis
    assert type(plain.basis) is Basis
    return plain, turned


def test_a_balance_says_the_same_in_either_basis(both):
    """Fits, screening, held-out blocks, unknown forces."""
    told = []
    for balance in both:
        noise_scale = balance.noise_scales[20]
        terms = [balance.term(PlateGain("plate_1"), ()), balance.term(ClockOffset("all"), (0.004,))]
        solved = balance.solve_at(terms, noise_scale)
        load = CarriedMass("torso")
        (screened,) = Screen(balance, [load]).best(noise_scale, terms)
        scores = block_scores(balance, terms, noise_scale, blocks(balance))
        forces = UnknownScreen(balance).at(unknown_forces(balance.scenes), Beside(terms, noise_scale))
        told.append(
            np.concatenate(
                [
                    [
                        solved.log_evidence,
                        screened.gain,
                        balance.mass_strain(solved),
                        balance.solve(terms).noise_scale.scale,
                    ],
                    solved.x,
                    *(np.diag(solved.of(k)[1]) for k in range(len(terms))),
                    solved.left_of(balance.residual),
                    scores.log_density,
                    *(e.ravel() for e in scores.error),
                    [one.gain for one in forces],
                ]
            )
        )
    np.testing.assert_allclose(told[1], told[0], rtol=1e-6, atol=1e-6)
