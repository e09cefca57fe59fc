"""The trajectory fit of a real walk whose segments keep their masses."""

from dataclasses import replace

import numpy as np
import pytest

from solver.capture.subject.opened_subject import open_subject
from solver.fitting.pipeline import solve
from solver.fitting.settings import Settings


@pytest.mark.slow
@pytest.mark.real
def test_a_walk_obeys_its_forces_without_fitting_inertias(real_data):
    subject, usual = open_subject(real_data / "walk_gait2354_subject01"), Settings()
    fixed = replace(usual, trajectory=replace(usual.trajectory, fit_inertias=False))
    fit = solve(subject, fixed)
    (trial,) = fit.trials
    assert trial.kinematics_only is not None
    assert fit.groundwork is not None
    given = [b.mass for b in fit.groundwork.skeleton.bodies]
    shares = np.array([b.mass for b in fit.skeleton.bodies]) / np.array(given)
    np.testing.assert_allclose(shares, shares[0])  # the body's mass may be another, its parts' shares not
    forces = np.linalg.norm(trial.dynamics.residual_root[trial.dynamics.used, :3], axis=1)
    alone = solve(subject, replace(usual, trajectory=replace(usual.trajectory, enabled=False))).trials[0]
    before = np.linalg.norm(alone.dynamics.residual_root[alone.dynamics.used, :3], axis=1)
    assert np.sqrt((forces**2).mean()) < 0.5 * np.sqrt((before**2).mean())
