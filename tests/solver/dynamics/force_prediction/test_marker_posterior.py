"""The posterior of a crane's motion against dense algebra that knows nothing of bands."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.interpolate import BSpline

from solver.dynamics.force_prediction import marker_posterior as module
from solver.dynamics.force_prediction.marker_noise import MarkerNoise
from solver.dynamics.force_prediction.marker_posterior import MarkerPosterior, MarkerTrack, marker_posterior
from solver.dynamics.momentum_terms import momentum_terms
from solver.dynamics.trajectory.terms.priors import jerk_level
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.weighted_means import windows_over
from solver.kinematics.frame_solver import root_dofs
from solver.kinematics.motion import Motion
from solver.kinematics.unseen_bodies import undetermined_dofs
from solver.skeleton.forward import ForwardKinematics
from solver.skeleton.pinocchio_model import RigidBodyModel

RATE, FRAMES, SPACING = 50.0, 45, 2
STRAY_M = 0.001
# No share of what is seen: own and shared errors are `least_m` each, and none are white.
SMOOTHNESS = 5.0
NOISE = MarkerNoise(
    own_share=0.0,
    shared_share=0.0,
    white_share=0.0,
    least_m=STRAY_M,
    smoothness=(SMOOTHNESS,),
    iterations=10,
    memory_s=10.0,
    knot_spacing_s=SPACING / RATE,
)
TRUSTING = TrajectorySettings(marker_robust_scale_m=1e3)
MEASURED = np.array([30.0, 60.0, -10.0, 5.0, -8.0, 20.0])


@dataclass(frozen=True, eq=False)
class Case:
    """The crane, splines through its trial, and what its markers' errors are."""

    kinematics: ForwardKinematics
    start: Motion
    design: tuple[np.ndarray, ...]  # frames × coefficients, orders 0 to 2
    jerk: np.ndarray  # coefficients × coefficients

    @property
    def skeleton(self):
        return self.kinematics.skeleton

    @property
    def pull(self):
        return np.where(root_dofs(self.skeleton), 0.0, TRUSTING.pose_std_rad**-2)

    def jerk_weight(self, settings, smoothness=SMOOTHNESS):
        return smoothness / jerk_level(self.start) ** 2

    def markers(self, c):
        return self.kinematics.markers(self.kinematics.poses(self.design[0] @ c))

    def wrench(self, c):
        """Required less measured, about the centre of mass."""
        states = [D @ c for D in self.design]
        model = RigidBodyModel(self.skeleton)
        return momentum_terms(model, *states, np.tile(MEASURED, (FRAMES, 1))).residual

    def covariance_of_markers(self):
        bodies = self.kinematics.marker_bodies
        return STRAY_M**2 * (np.eye(len(bodies)) + (bodies[:, None] == bodies))

    def coefficients(self, posterior: MarkerPosterior):
        stacked = np.concatenate(self.design)
        values = np.concatenate([posterior.motion.q, posterior.velocity, posterior.acceleration])
        return np.linalg.lstsq(stacked, values, rcond=None)[0]


@pytest.fixture(scope="module")
def case(crane, crane_q) -> Case:
    pieces = -(-(FRAMES - 1) // SPACING)
    knots = np.arange(-5, pieces + 6) * SPACING / RATE
    spline = BSpline(knots, np.eye(pieces + 5), 5)
    t = np.arange(FRAMES) / RATE
    x, w = np.polynomial.legendre.leggauss(3)
    width = SPACING / RATE
    nodes = ((np.arange(pieces)[:, None] + (x + 1) / 2) * width).ravel()
    third = spline(nodes, nu=3)
    jerk = third.T @ (np.tile(w * width / 2, pieces)[:, None] * third)
    design = tuple(spline(t, nu=o) for o in range(3))
    return Case(ForwardKinematics(crane), Motion(crane.dofs, crane_q[:FRAMES], RATE), design, jerk)


def exponential(rate_s: float) -> np.ndarray:
    """Correlation of a Gauss-Markov process over the frames."""
    t = np.arange(FRAMES) / RATE
    return np.exp(-np.abs(t[:, None] - t) / rate_s)


def walked(time_s: float) -> np.ndarray:
    """Its inverse as ∫ e²/2τ + τ ė²/2 dt, frame by frame."""
    step = 1 / RATE
    difference = np.diff(np.eye(FRAMES), axis=0) / step
    return step * (np.eye(FRAMES) / (2 * time_s) + time_s / 2 * difference.T @ difference)


def dense_precision(case: Case, c: np.ndarray, in_time: np.ndarray) -> np.ndarray:
    """Of the coefficients: markers' Jacobian by finite differences, inverse covariance of errors, priors."""
    q, dofs = case.design[0] @ c, c.shape[1]
    step = 1e-6
    by_dof = []
    for j in range(dofs):
        shift = step * np.eye(dofs)[j]
        ahead, behind = (case.kinematics.markers(case.kinematics.poses(q + s)) for s in (shift, -shift))
        by_dof.append((ahead - behind) / (2 * step))
    J = np.stack(by_dof, axis=3)  # frames, markers, 3, dofs
    full = np.einsum("tmcd,ta->tmcad", J, case.design[0]).reshape(FRAMES, len(J[0]), 3, -1)
    weighed = np.einsum("ts,smcx->tmcx", in_time, full)
    weighed = np.einsum("mn,tncx->tmcx", np.linalg.inv(case.covariance_of_markers()), weighed)
    A = np.tensordot(full, weighed, axes=([0, 1, 2], [0, 1, 2]))
    return (
        A
        + np.kron(case.jerk, np.diag(case.jerk_weight(TRUSTING)))
        + np.kron(case.design[0].T @ case.design[0], np.diag(case.pull))
    )


def rows_by_coefficients(case: Case, c: np.ndarray, windows) -> np.ndarray:
    """The wrench's window means by the coefficients, from finite differences."""
    columns, step = [], 1e-6
    for k in range(c.size):
        shift = np.zeros(c.size)
        shift[k] = step
        ahead, behind = (case.wrench(c + s * shift.reshape(c.shape)) for s in (1, -1))
        columns.append(windows.means(ahead - behind).ravel() / (2 * step))
    return np.stack(columns, axis=1)


@pytest.fixture(scope="module")
def windows():
    return windows_over(np.ones(FRAMES, dtype=bool), RATE, 0.1, 0.08)


@pytest.fixture(scope="module")
def noisy(case) -> np.ndarray:
    c = np.linalg.lstsq(case.design[0], case.start.q, rcond=None)[0]
    return case.markers(c) + np.random.default_rng(1).normal(0, STRAY_M, (FRAMES, 16, 3))


@pytest.fixture(scope="module")
def posterior(case, noisy) -> MarkerPosterior:
    return marker_posterior(case.skeleton, noisy, case.start, NOISE, TRUSTING)


@pytest.fixture(scope="module")
def covariance(posterior, windows) -> np.ndarray:
    terms = posterior.momentum(np.tile(MEASURED, (FRAMES, 1)))
    return posterior.covariance(terms, windows)


@pytest.fixture(scope="module")
def slopes(case, posterior, windows) -> np.ndarray:
    return rows_by_coefficients(case, case.coefficients(posterior), windows)


def test_the_wrenchs_covariance_is_that_of_the_dense_matrix(case, posterior, covariance, slopes):
    A = dense_precision(case, case.coefficients(posterior), walked(NOISE.time_s))
    expected = slopes @ np.linalg.solve(A, slopes.T)
    np.testing.assert_allclose(covariance, expected, atol=1e-4 * np.abs(expected).max())


def test_marker_errors_are_those_of_the_exact_process_up_to_the_frames_spacing(
    case, posterior, covariance, slopes
):
    """A fifth of the correlation time from frame to frame; hardly less, and more only near the ends."""
    A = dense_precision(case, case.coefficients(posterior), np.linalg.inv(exponential(NOISE.time_s)))
    expected = slopes @ np.linalg.solve(A, slopes.T)
    inner = slice(12, -12)
    ratio = np.linalg.eigvals(np.linalg.solve(expected[inner, inner], covariance[inner, inner])).real
    assert ratio.min() > 0.98
    assert ratio.max() < 1.1


def test_a_short_memory_changes_little(posterior, windows, covariance):
    short = replace(posterior, memory_s=0.3)
    cut = short.covariance(short.momentum(np.tile(MEASURED, (FRAMES, 1))), windows)
    assert np.linalg.eigvalsh(cut)[0] > 0
    np.testing.assert_allclose(np.diag(cut), np.diag(covariance), rtol=0.02)


def drawn(case: Case, smoothness: float, rng: np.random.Generator):
    """Motions from the prior, small where it is open, and markers with errors from the exact process.

    Yields coefficients and what is observed, without end.
    """
    T = np.linalg.cholesky(exponential(NOISE.time_s))
    M = np.linalg.cholesky(case.covariance_of_markers())
    B = case.design[0]
    weight, dofs = case.jerk_weight(TRUSTING, smoothness), len(case.pull)
    middle = np.zeros((B.shape[1], dofs))
    spreads = []
    for j in range(dofs):
        P = weight[j] * case.jerk + case.pull[j] * B.T @ B
        if case.pull[j]:
            middle[:, j] = np.linalg.solve(P, case.pull[j] * B.T @ case.start.q[:, j])
        else:
            parabola = np.polyfit(np.arange(FRAMES), case.start.q[:, j], 2)
            middle[:, j] = np.linalg.lstsq(B, np.polyval(parabola, np.arange(FRAMES)), rcond=None)[0]
        size, axes = np.linalg.eigh(P)
        spreads.append(axes * np.minimum(1 / np.sqrt(np.maximum(size, 1e-12)), 0.05))
    while True:
        c = middle + np.stack([s @ rng.normal(size=len(s)) for s in spreads], axis=1)
        error = np.einsum("ts,mn,snc->tmc", T, M, rng.normal(size=(FRAMES, len(M), 3)))
        yield c, case.markers(c) + error


@pytest.mark.parametrize("smoothness", [0.5, 50.0, 5000.0])
def test_markers_choose_how_smooth_their_motion_is(case, smoothness):
    noise = replace(NOISE, smoothness=(0.05, 0.5, 5.0, 50.0, 500.0, 5000.0, 50000.0))
    for _, (_, observed) in zip(range(5), drawn(case, smoothness, np.random.default_rng(4)), strict=False):
        chosen = marker_posterior(case.skeleton, observed, case.start, noise, TRUSTING).smoothness
        assert chosen == smoothness


def test_what_no_marker_shows_moves_half_as_much_and_as_fast_as_what_they_show(case, noisy):
    """Variances of angle and acceleration, by the spectrum of the process that is its prior."""
    skeleton, last = case.skeleton, case.kinematics.marker_bodies == case.kinematics.marker_bodies.max()
    observed = np.where(last[:, None], np.nan, noisy)
    unseen = undetermined_dofs(skeleton, observed)
    assert unseen.any()
    track = MarkerTrack(
        skeleton, observed, replace(case.start, q=np.where(unseen, 0.0, case.start.q)), NOISE, TRUSTING
    )
    shown = case.start.low_passed(8.0)
    omega = np.linspace(0.0, 1000.0, 200_001)
    for j in np.flatnonzero(unseen):
        density = 1 / (RATE * track.pull[j] + SMOOTHNESS / track.jerk[j] ** 2 * omega**6) / np.pi
        for order, of_others in ((0, shown.q - shown.q[4:-4].mean(axis=0)), (2, shown.derivative(2))):
            own = np.sqrt(np.trapezoid(omega ** (2 * order) * density, omega))
            others = np.sqrt((of_others[4:-4, ~unseen & ~root_dofs(skeleton)] ** 2).mean())
            assert own == pytest.approx(0.5 * others, rel=0.02)


def far_out(case: Case, windows, c: np.ndarray, posterior: MarkerPosterior) -> float:
    """Mean square of the required wrench's errors in stated standard deviations."""
    terms = posterior.momentum(np.tile(MEASURED, (FRAMES, 1)))
    wrong = windows.means(terms.residual - case.wrench(c)).ravel()
    return float(wrong @ np.linalg.solve(posterior.covariance(terms, windows), wrong) / len(wrong))


def test_errors_of_the_required_wrench_lie_within_their_covariance(case, windows):
    """Motions from the prior, errors from the exact process."""
    squares = []
    for _, (c, observed) in zip(range(25), drawn(case, SMOOTHNESS, np.random.default_rng(7)), strict=False):
        posterior = marker_posterior(case.skeleton, observed, case.start, NOISE, TRUSTING)
        squares.append(far_out(case, windows, c, posterior))
    assert np.mean(squares) == pytest.approx(1.0, abs=0.15)


def far_out_by(case: Case, windows, white_m: float, noise: MarkerNoise) -> float:
    """Likewise over some motions, cameras' noise added."""
    squares, rng = [], np.random.default_rng(5)
    for _, (c, observed) in zip(range(15), drawn(case, SMOOTHNESS, np.random.default_rng(8)), strict=False):
        seen = observed + rng.normal(0, white_m, observed.shape)
        start = replace(case.start, q=case.design[0] @ c)
        posterior = marker_posterior(case.skeleton, seen, start, noise, TRUSTING)
        squares.append(far_out(case, windows, c, posterior))
    return float(np.mean(squares))


@pytest.mark.slow
@pytest.mark.parametrize("white_m", [0.004, 0.008])
def test_white_noise_of_the_cameras_is_seen_and_allowed_for(case, windows, white_m):
    """Nobody says how large it is. Stated rightly at one frequency, it is within a factor over all."""
    assert far_out_by(case, windows, white_m, NOISE) > 3
    assert 0.2 < far_out_by(case, windows, white_m, replace(NOISE, white_share=1.0)) < 1.2


def test_a_last_frame_that_is_held_by_itself_changes_nothing(case, noisy, posterior, monkeypatch):
    monkeypatch.setattr(module, "CHUNK", FRAMES - 1)
    again = marker_posterior(case.skeleton, noisy, case.start, NOISE, TRUSTING)
    assert again.motion.q == pytest.approx(posterior.motion.q, abs=1e-9)


@pytest.fixture(scope="module")
def observed(noisy) -> np.ndarray:
    gappy = noisy.copy()
    gappy[10:18, 3] = np.nan
    gappy[:6, 9] = np.nan
    gappy[30:33] = np.nan
    gappy[20:24, 12] += [0.05, 0.0, -0.04]
    return gappy


class TestWithGapsAndOutliers:
    SETTINGS = TrajectorySettings()

    def cost(self, case, observed, c) -> float:
        """Errors weighed by segment as the module's head says, in numbers of their own."""
        seen = np.isfinite(observed).all(axis=2)
        first = case.kinematics.markers(case.kinematics.poses(case.start.q))
        far = np.where(seen, ((observed - first) ** 2).sum(axis=2), 0.0)
        trust = seen / (1 + far / self.SETTINGS.marker_robust_scale_m**2)
        error = np.where(seen[..., None], case.markers(c) - observed, 0.0)
        total = 0.0
        for body in np.unique(case.kinematics.marker_bodies):
            own = case.kinematics.marker_bodies == body
            for t in range(FRAMES):
                total += _weighed(trust[t, own], error[t, own]) / (2 * NOISE.time_s * RATE)
                if t:
                    both = np.minimum(trust[t, own], trust[t - 1, own]) * seen[t, own] * seen[t - 1, own]
                    total += _weighed(both, error[t, own] - error[t - 1, own]) * NOISE.time_s * RATE / 2
        pulled = (case.pull * (case.design[0] @ c - case.start.q) ** 2).sum()
        jerk = (case.jerk_weight(self.SETTINGS) * np.einsum("ad,ab,bd->d", c, case.jerk, c)).sum()
        return 0.5 * (total + pulled + jerk)

    def test_no_small_step_lowers_the_cost(self, case, observed):
        noise = replace(NOISE, iterations=30)
        posterior = marker_posterior(case.skeleton, observed, case.start, noise, self.SETTINGS)
        best = case.coefficients(posterior)
        away = np.linalg.lstsq(case.design[0], case.start.q, rcond=None)[0]
        rng = np.random.default_rng(2)
        for _ in range(12):
            direction = rng.normal(size=best.shape)
            slope, slope_away = (
                (
                    self.cost(case, observed, c + 1e-5 * direction)
                    - self.cost(case, observed, c - 1e-5 * direction)
                )
                / 2e-5
                for c in (best, away)
            )
            assert abs(slope) < 2e-3 * abs(slope_away)

    def test_four_iterations_settle(self, case, observed, windows):
        few, many = (
            marker_posterior(case.skeleton, observed, case.start, replace(NOISE, iterations=n), self.SETTINGS)
            for n in (MarkerNoise().iterations, 30)
        )
        terms = [p.momentum(np.tile(MEASURED, (FRAMES, 1))) for p in (few, many)]
        std = np.sqrt(np.diag(many.covariance(terms[1], windows)))
        moved = windows.means(terms[0].residual - terms[1].residual).ravel()
        assert np.abs(moved / std).max() < 0.05


def test_the_size_of_marker_errors_is_what_the_typical_marker_moves_on_its_segment(case, windows):
    """Constant offsets do not move; half of a wobble of 4 mm is as good as 2 mm that were told."""
    c = np.linalg.lstsq(case.design[0], case.start.q, rcond=None)[0]
    rng = np.random.default_rng(3)
    offset, wobble = rng.normal(0, 0.01, (1, 16, 3)), rng.normal(0, 0.004, (FRAMES, 16, 3))
    R = case.kinematics.poses(case.start.q).R_ground_body[:, case.kinematics.marker_bodies]
    observed = case.markers(c) + (R @ offset[..., None])[..., 0] + wobble
    variances = []
    for noise in (
        MarkerNoise(own_share=0.5, shared_share=0.5, white_share=0.0),
        MarkerNoise(own_share=0.0, shared_share=0.0, white_share=0.0, least_m=0.002),
    ):
        posterior = marker_posterior(case.skeleton, observed, case.start, noise, TRUSTING)
        terms = posterior.momentum(np.tile(MEASURED, (FRAMES, 1)))
        variances.append(np.diag(posterior.covariance(terms, windows)))
    np.testing.assert_allclose(variances[0], variances[1], rtol=0.1)


def _weighed(weight: np.ndarray, error: np.ndarray) -> float:
    """eᵀ (own² diag(1/w) + shared² 11ᵀ)⁻¹ e over markers that weigh anything, all three coordinates."""
    some = weight > 0
    if not some.any():
        return 0.0
    C = STRAY_M**2 * (np.diag(1 / weight[some]) + 1.0)
    return float((error[some] * np.linalg.solve(C, error[some])).sum())
