"""A crane's trial in several chunks, at an iterate away from its markers and forces."""

from dataclasses import dataclass

import numpy as np
import pytest

from solver.dynamics.inertia_parameters import InertiaParameters, inertia_parameters
from solver.dynamics.trajectory.bordered_system import TrialGradient, TrialSystem
from solver.dynamics.trajectory.spline_band import from_blocks, in_blocks, nearest_spline
from solver.dynamics.trajectory.spline_basis import spline_basis
from solver.dynamics.trajectory.terms import term
from solver.dynamics.trajectory.terms.term import SharedParameters, TrialPoint
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.dynamics.trajectory.trial_data import TrialData
from solver.kinematics.motion import Motion
from solver.skeleton.forward import ForwardKinematics, marker_positions

FRAMES, RATE, SPACING = 23, 50.0, 2
SETTINGS = TrajectorySettings(knot_spacing_s=SPACING / RATE)
EXTRA = 2


@dataclass(frozen=True, eq=False)
class Case:
    """Data, an iterate as one vector [coefficients, φ, x], and what terms give there."""

    skeleton: object
    data: TrialData
    inertias: InertiaParameters
    coefficients: np.ndarray
    shared: np.ndarray

    @property
    def basis(self):
        return spline_basis(FRAMES, RATE, SPACING)

    @property
    def iterate(self):
        return np.concatenate([self.coefficients.ravel(), self.shared])

    @property
    def frame_weight(self):
        return 100.0 / RATE

    def at(self, iterate):
        size = self.coefficients.size
        c, phi, x = np.split(iterate, [size, size + self.inertias.count])
        shared = SharedParameters(self.inertias, phi, x, inertias_free=True)
        kinematics = ForwardKinematics(self.skeleton)
        return TrialPoint(self.basis, kinematics, c.reshape(self.coefficients.shape), shared)

    def gradient(self, term, iterate):
        at = self.at(iterate)
        gradient = TrialGradient.zero(at.coefficients.shape, at.shared.count)
        term.add_gradient(at, gradient)
        return flat(gradient)

    def system(self, term, iterate):
        at = self.at(iterate)
        system = TrialSystem.zero(at.basis, at.coefficients.shape[1], at.shared.count)
        term.add_linearized(at, system)
        return system

    def derivatives(self, rows, iterate, step=1e-5):
        """Dense, of rows(iterate), by central differences."""
        moves = step * np.eye(len(iterate))
        return np.stack([(rows(iterate + m) - rows(iterate - m)) / (2 * step) for m in moves], axis=1)

    def assert_least_squares(self, term, rows):
        """The term is ‖rows‖² at the iterate, to second order as Gauss-Newton has it."""
        R, J = rows(self.iterate), self.derivatives(rows, self.iterate)
        system = self.system(term, self.iterate)
        assert np.linalg.norm(R) > 0
        assert system.gradient.cost == pytest.approx(R @ R, rel=1e-6)
        found, expected = dense(system), J.T @ J
        np.testing.assert_allclose(flat(system.gradient), J.T @ R, atol=1e-6 * np.abs(J.T @ R).max())
        # Each entry against what its row and column are worth: blocks differ by powers of ten.
        worth = np.sqrt(np.diag(expected))
        assert np.all(np.abs(found - expected) <= 1e-6 * np.outer(worth, worth) + 1e-7)


def flat(gradient):
    return np.concatenate([gradient.coefficients.ravel(), gradient.shared])


def dense(system):
    """Band, border and corner as one matrix."""
    shape = system.gradient.coefficients.shape
    size = shape[0] * shape[1]
    unit = np.eye(size).reshape(*shape, size)
    band = from_blocks(system.band.block_tridiagonal().times(in_blocks(unit)), *shape).reshape(size, size)
    border = system.border.reshape(size, -1)
    return np.block([[band, border], [border.T, system.corner]])


@pytest.fixture(autouse=True)
def _several_chunks(monkeypatch):
    monkeypatch.setattr(term, "CHUNK", 8)


@pytest.fixture(scope="session")
def case(crane, crane_q):
    rng = np.random.default_rng(8)
    start = Motion(crane.dofs, crane_q[:FRAMES], RATE)
    observed = marker_positions(crane, start.q) + rng.normal(0, 0.004, (FRAMES, len(crane.markers), 3))
    observed[5:9, 3] = np.nan
    observed[:, 7] = np.nan
    counts = np.ones(FRAMES, dtype=bool)
    counts[6:11] = False
    weight = np.array([0.0, 9.81 * crane.mass, 0.0, 0.0, 0.0, 0.0])
    data = TrialData(
        observed,
        weight + rng.normal(0, 3, (FRAMES, 6)),
        counts,
        start,
        extra_wrench_ground=rng.normal(0, 2, (FRAMES, 6)),
        extra_columns_ground=rng.normal(0, 1, (FRAMES, 6, EXTRA)),
    )
    inertias = inertia_parameters(crane)
    c = nearest_spline(spline_basis(FRAMES, RATE, SPACING), start.q)
    shared = np.concatenate([rng.normal(0, 0.02, inertias.count), [1.5, -0.5]])
    return Case(crane, data, inertias, c + rng.normal(0, 0.003, c.shape), shared)
