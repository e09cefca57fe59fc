"""What every term of a trial has to keep to."""

from dataclasses import replace

import numpy as np
import pytest

from solver.dynamics.trajectory.bordered_system import TrialGradient, TrialSystem
from solver.dynamics.trajectory.terms.markers import Markers
from solver.dynamics.trajectory.terms.priors import HeldEnds, PosePull, Smoothness
from solver.dynamics.trajectory.terms.root_residual import RootResidual
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory.trajectory_solver import trial_levels
from solver.skeleton.forward import ForwardKinematics

# Scales within which every robust loss is well off its parabola.
SETTINGS = TrajectorySettings(marker_robust_scale_m=0.008, residual_robust_scale=2.0)


def levels_of(case):
    kinematics = ForwardKinematics(case.skeleton)
    return trial_levels(kinematics, case.data.observed_ground, case.data.start, SETTINGS)


MAKERS = {
    "markers": lambda c: Markers(
        ForwardKinematics(c.skeleton),
        c.data.observed_ground,
        c.data.start,
        SETTINGS,
        levels_of(c).marker_errors,
    ),
    "root residual": lambda c: RootResidual(c.data, SETTINGS),
    "pose pull": lambda c: PosePull(c.data.start, levels_of(c).pull),
    "held ends": lambda c: HeldEnds(
        c.coefficients[:, : c.data.start.q.shape[1]] + 1e-9, before=True, after=True
    ),
    "smoothness": lambda c: Smoothness(levels_of(c).jerk, SETTINGS),
}
BESIDE = 6  # columns of the spline behind the dofs


@pytest.fixture(params=MAKERS)
def term(request, case):
    return MAKERS[request.param](case)


def test_gradient_is_that_of_the_cost(case, term):
    gradient, rng = 2 * case.gradient(term, case.iterate), np.random.default_rng(3)
    size = case.coefficients.size
    parts = (slice(0, size), slice(size, size + case.inertias.count), slice(size + case.inertias.count, None))
    for part in parts:
        for _ in range(3):
            direction = np.zeros(len(case.iterate))
            direction[part] = rng.normal(size=len(direction[part]))
            step = 1e-6 * direction
            ahead, behind = (term.cost(case.at(case.iterate + sign * step)) for sign in (1, -1))
            scale = np.abs(gradient * direction).sum()
            assert (ahead - behind) / 2e-6 == pytest.approx(gradient @ direction, abs=1e-5 * scale + 1e-9)


def test_linearized_has_the_same_gradient_and_cost(case, term):
    system = case.system(term, case.iterate)
    alone = case.gradient(term, case.iterate)
    assert np.abs(alone).max() > 0
    together = np.concatenate([system.gradient.coefficients.ravel(), system.gradient.shared])
    np.testing.assert_allclose(together, alone, atol=1e-12 * np.abs(alone).max())
    assert system.gradient.cost == pytest.approx(term.cost(case.at(case.iterate)), rel=1e-12)


def test_what_other_terms_added_stays(case, term):
    at, alone = case.at(case.iterate), case.system(term, case.iterate)
    system = TrialSystem.zero(at.basis, at.coefficients.shape[1], at.shared.count)
    gradient = TrialGradient.zero(at.coefficients.shape, at.shared.count)
    arrays = (system.band.panels, system.border, system.corner)
    gradients = (system.gradient.coefficients, system.gradient.shared, gradient.coefficients, gradient.shared)
    for array in (*arrays, *gradients):
        np.add(array, 7.0, out=array)
    system.gradient.cost = gradient.cost = 7.0
    term.add_linearized(at, system)
    term.add_gradient(at, gradient)
    assert system.gradient.cost == gradient.cost == pytest.approx(7.0 + alone.gradient.cost)
    expected = (alone.band.panels, alone.border, alone.corner)
    both = (alone.gradient.coefficients, alone.gradient.shared)
    for array, own in zip((*arrays, *gradients), (*expected, *both, *both), strict=True):
        np.testing.assert_allclose(array, 7.0 + own, rtol=1e-9, atol=1e-9)


def test_columns_behind_the_dofs_are_left_to_others(case, term):
    at, alone = case.at(case.iterate), case.system(term, case.iterate)
    count, dofs = at.coefficients.shape
    beside = np.random.default_rng(4).normal(size=(count, BESIDE))
    wide = replace(at, coefficients=np.concatenate([at.coefficients, beside], axis=1))
    system = TrialSystem.zero(wide.basis, dofs + BESIDE, wide.shared.count)
    gradient = TrialGradient.zero(wide.coefficients.shape, wide.shared.count)
    term.add_linearized(wide, system)
    term.add_gradient(wide, gradient)
    assert system.gradient.cost == pytest.approx(alone.gradient.cost, rel=1e-12)
    assert term.cost(wide) == pytest.approx(alone.gradient.cost, rel=1e-12)
    own = np.abs(alone.band.panels).max()
    np.testing.assert_allclose(system.band.panels[:, :dofs, :, :dofs], alone.band.panels, atol=1e-12 * own)
    assert not system.band.panels[:, dofs:].any()
    assert not system.band.panels[:, :, :, dofs:].any()
    np.testing.assert_allclose(system.border[:, :dofs], alone.border, rtol=1e-9, atol=1e-9)
    for found in (system.gradient.coefficients, gradient.coefficients):
        np.testing.assert_allclose(found[:, :dofs], alone.gradient.coefficients, rtol=1e-9, atol=1e-9)
        assert not found[:, dofs:].any()
    assert not system.border[:, dofs:].any()
