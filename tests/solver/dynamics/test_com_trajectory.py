"""The trajectory against the paper's dense matrix, against motions that obey their forces, and at gaps."""

from dataclasses import replace

import numpy as np
import pytest

from solver.dynamics.com_settings import ComSettings
from solver.dynamics.com_trajectory import ComData, MassPrior, fit_com_trajectory

SETTINGS = ComSettings()
AS_IN_THE_PAPER = replace(SETTINGS, force_error_m_s2=0.0)


def _paper_system(data: ComData, alpha: float) -> tuple[np.ndarray, np.ndarray]:
    """A and b of eq. linear_map, ζ = [z₁, ż₁, μ, z̈_u …]; the three axes of a time side by side."""
    T, dt, unseen = data.frames, 1 / data.rate, np.flatnonzero(~data.observed)
    A = np.zeros((3 * (T + len(unseen)), 7 + 3 * len(unseen)))
    b = np.zeros(len(A))
    axes = np.eye(3)
    for t in range(T):
        rows = slice(3 * t, 3 * t + 3)
        A[rows, 0:3] = axes
        A[rows, 3:6] = t * dt * axes
        for s in np.flatnonzero(data.observed[:t]):
            A[rows, 6] += (t - s) * dt**2 * data.force_ground[s]
            b[rows] += (t - s) * dt**2 * data.gravity
        for i, u in enumerate(unseen[unseen < t]):
            A[rows, 7 + 3 * i : 10 + 3 * i] = (t - u) * dt**2 * axes
    A[3 * T :, 7:] = alpha * np.eye(3 * len(unseen))
    return A, b


def _disturbed(data: ComData, rng: np.random.Generator) -> ComData:
    noise = 0.01 * np.cumsum(rng.normal(size=data.com_ground.shape), axis=0)
    force = data.force_ground + rng.normal(size=data.force_ground.shape) * [20.0, 60.0, 20.0]
    return replace(data, com_ground=data.com_ground + noise, force_ground=force)


def _mask(kind: str, frames: int, rng: np.random.Generator) -> np.ndarray:
    observed = np.ones(frames, dtype=bool)
    if kind == "all unseen":
        observed[:] = False
    elif kind == "unseen ends":
        observed[: frames // 5 + 1] = observed[-(frames // 4 + 1) :] = False
    elif kind == "only ends seen":
        observed[1:-1] = False
    elif kind == "one in the middle":
        observed[frames // 2] = False
    elif kind == "one seen":
        observed[:] = False
        observed[frames // 2] = True
    elif kind.startswith("random"):
        observed = rng.random(frames) >= float(kind.split()[1])
    return observed


@pytest.mark.slow
@pytest.mark.parametrize(
    ("frames", "kind"),
    [
        *((3, kind) for kind in ("all seen", "all unseen", "one in the middle", "only ends seen")),
        *((60, kind) for kind in ("all seen", "unseen ends", "one in the middle", "one seen", "random 0.9")),
        (60, "only ends seen"),
        (150, "all unseen"),
        (500, "all seen"),
        (500, "random 0.1"),
        (500, "random 0.4"),
        (500, "unseen ends"),
    ],
)
@pytest.mark.parametrize("rate", [100.0, 250.0])
def test_equals_the_papers_dense_pseudo_inverse(walker, frames, kind, rate):
    rng = np.random.default_rng(frames)
    data = replace(_disturbed(walker(frames, rate=rate), rng), observed=_mask(kind, frames, rng))
    A, b = _paper_system(data, SETTINGS.alpha_s2)
    unseen = ~data.observed
    measured = np.concatenate([data.com_ground.ravel(), np.zeros(3 * unseen.sum())])
    expected = A @ (np.linalg.pinv(A) @ (measured - b)) + b
    found = fit_com_trajectory(data, AS_IN_THE_PAPER)
    np.testing.assert_allclose(found.com_ground.ravel(), expected[: 3 * frames], rtol=0, atol=1e-8)
    accelerations = SETTINGS.alpha_s2 * found.acceleration_ground[unseen]
    np.testing.assert_allclose(accelerations.ravel(), expected[3 * frames :], rtol=0, atol=1e-8)


def test_its_own_unknowns_give_the_trajectory_back_through_the_papers_system(walker):
    rng = np.random.default_rng(1)
    data = replace(_disturbed(walker(120), rng), observed=_mask("random 0.3", 120, rng))
    found = fit_com_trajectory(data, AS_IN_THE_PAPER)
    A, b = _paper_system(data, SETTINGS.alpha_s2)
    zeta = np.concatenate(
        [
            found.com_ground[0],
            (found.com_ground[1] - found.com_ground[0]) * found.rate
            - found.acceleration_ground[0] / found.rate,  # before the first step of semi-implicit Euler
            [found.inverse_mass],
            found.acceleration_ground[~data.observed].ravel(),
        ]
    )
    np.testing.assert_allclose((A @ zeta + b)[: 3 * 120], found.com_ground.ravel(), rtol=0, atol=1e-9)


@pytest.mark.parametrize("force_error", [0.02, 0.2, 2.0])
def test_doubted_forces_equal_dense_least_squares_over_all_accelerations(walker, force_error):
    rng = np.random.default_rng(2)
    data = replace(_disturbed(walker(80), rng), observed=_mask("random 0.3", 80, rng))
    settings = replace(SETTINGS, force_error_m_s2=force_error)
    free = replace(data, observed=np.zeros(80, dtype=bool))
    A, _ = _paper_system(free, 1.0)  # every acceleration unknown
    weight = np.where(data.observed, settings.com_error_m / force_error, settings.alpha_s2)
    A[240:] *= np.repeat(weight, 3)[:, None]
    A[240:, 6] = (-np.where(data.observed, weight, 0.0)[:, None] * data.force_ground).ravel()
    gravity = np.where(data.observed, weight, 0.0)[:, None] * data.gravity
    zeta = np.linalg.pinv(A) @ np.concatenate([data.com_ground.ravel(), gravity.ravel()])
    found = fit_com_trajectory(data, settings)
    np.testing.assert_allclose(found.com_ground.ravel(), (A @ zeta)[:240], rtol=0, atol=1e-8)
    np.testing.assert_allclose(found.inverse_mass, zeta[6], rtol=1e-6)


@pytest.mark.parametrize("settings", [AS_IN_THE_PAPER, SETTINGS], ids=["as in the paper", "default"])
@pytest.mark.parametrize("rate", [100.0, 1000.0])
def test_ten_thousand_frames_that_obey_their_forces_come_back_as_they_were(walker, settings, rate):
    data = walker(10_000, rate=rate, mass_kg=81.0)
    found = fit_com_trajectory(data, settings)
    np.testing.assert_allclose(found.com_ground, data.com_ground, rtol=0, atol=1e-8)
    assert found.mass is not None
    assert found.mass.mass_kg == pytest.approx(81.0, rel=1e-8)


def test_unseen_frames_do_not_disturb_the_mass(walker, unseen_steps):
    data = walker(10_000)
    hidden = unseen_steps(10_000, 100.0)
    found = fit_com_trajectory(data.without(hidden), AS_IN_THE_PAPER)
    assert found.mass is not None
    assert found.mass.mass_kg == pytest.approx(81.0, rel=0.01)


def test_forces_of_unseen_frames_play_no_part(walker, unseen_steps):
    data = walker(400).without(unseen_steps(400, 100.0))
    nonsense = np.where(data.observed[:, None], data.force_ground, 1e5)
    before, after = (fit_com_trajectory(d, SETTINGS) for d in (data, replace(data, force_ground=nonsense)))
    np.testing.assert_array_equal(before.com_ground, after.com_ground)
    assert before.mass == after.mass


def test_no_step_where_a_foot_leaves_or_comes_back(walker, unseen_steps):
    """Velocity changes by no more at the borders of U than the accelerations of the trial allow."""
    rng = np.random.default_rng(4)
    data = walker(600)
    data = replace(data, com_ground=data.com_ground + rng.normal(size=(600, 3)) * 0.002)
    hidden = unseen_steps(600, 100.0)
    found = fit_com_trajectory(data.without(hidden), SETTINGS)
    borders = np.flatnonzero(np.diff(hidden))
    change = np.linalg.norm(np.diff(found.com_ground, 2, axis=0) * data.rate**2, axis=1)
    at_borders = np.concatenate([change[borders - 1], change[borders]])
    elsewhere = np.delete(change, np.concatenate([borders - 1, borders]))
    assert at_borders.max() <= 1.5 * elsewhere.max()


def test_a_trial_on_unseen_ground_is_smoothed_markers_without_a_mass(walker):
    data = walker(300)
    blind = fit_com_trajectory(replace(data, observed=np.zeros(300, dtype=bool)), SETTINGS)
    assert blind.mass is None
    assert np.abs(blind.com_ground - data.com_ground)[20:-20].max() < 1e-3  # walking lies below 5 Hz


def test_flight_alone_tells_no_mass(walker):
    data = walker(50)
    falling = replace(data, force_ground=np.zeros((50, 3)))
    assert fit_com_trajectory(falling, SETTINGS).mass is None


@pytest.mark.parametrize("frames", [1, 2])
def test_a_trial_of_one_or_two_frames_stays_as_it_is(walker, frames):
    data = walker(frames)
    found = fit_com_trajectory(data, SETTINGS)
    np.testing.assert_array_equal(found.com_ground, data.com_ground)
    assert found.mass is None


@pytest.mark.parametrize("settings", [AS_IN_THE_PAPER, SETTINGS], ids=["as in the paper", "default"])
def test_a_fixed_mass_is_kept(walker, settings):
    found = fit_com_trajectory(walker(200), settings, MassPrior(75.0, 0.0))
    assert found.mass is not None
    assert found.mass.mass_kg == pytest.approx(75.0, rel=1e-12)
    assert found.mass.std_kg == 0.0
    assert found.inverse_mass == pytest.approx(1 / 75.0, rel=1e-12)


def test_in_the_papers_form_observed_accelerations_are_force_over_mass_less_gravity(walker):
    rng = np.random.default_rng(6)
    data = _disturbed(walker(200), rng)
    data = data.without(_mask("random 0.3", 200, rng))
    found = fit_com_trajectory(data, AS_IN_THE_PAPER, MassPrior(75.0, 0.0))
    seen = np.flatnonzero(data.observed)
    expected = data.force_ground[seen] / 75.0 + data.gravity
    np.testing.assert_allclose(found.acceleration_ground[seen], expected, atol=1e-12)
    inner = seen[(seen > 0) & (seen < 199)]
    stepped = np.diff(found.com_ground, 2, axis=0)[inner - 1] * data.rate**2
    np.testing.assert_allclose(stepped, data.force_ground[inner] / 75.0 + data.gravity, atol=1e-8)
