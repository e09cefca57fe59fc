"""Inverse dynamics of a real walk, ours against OpenSim's on the files that we export for it."""

import numpy as np
import pytest

from benchmarks.opensim_reference import referee
from solver.common.gravity import GRAVITY
from solver.export.opensim import export_opensim

pytestmark = [pytest.mark.opensim, pytest.mark.real]


@pytest.mark.slow
@pytest.mark.parametrize("recording", ["walk_rajagopal2015", "walk_gait2354_subject01"])
def test_opensim_agrees_within_a_percent_of_body_weight(recording, recorded_fit, tmp_path):
    """1 % of body weight, 0.2 % of body weight · height, as RMS over the frames used.

    What remains on the first model (0.08 %, 0.04 %) is Simbody's: a knee whose turns about several axes
    depend on one coordinate gets wrong velocity terms there. The second model has no such joint.
    """
    pytest.importorskip("opensim")
    fit = recorded_fit(recording)
    (trial,) = fit.trials
    export_opensim(fit, tmp_path)
    verdict = referee(tmp_path, trial.capture.name)
    dynamics, body_weight = trial.dynamics, fit.mass_kg * GRAVITY
    rows = np.round((verdict.times - dynamics.motion.times[0]) * dynamics.motion.rate).astype(int)
    used = dynamics.used[rows]
    assert used.sum() == dynamics.used.sum() > 100
    difference = (verdict.residual_root - dynamics.residual_root[rows])[used]
    force, moment = (np.sqrt(np.mean(np.sum(part**2, axis=1))) for part in np.hsplit(difference, 2))
    assert force < 0.01 * body_weight
    assert moment < 0.002 * body_weight * fit.height_m
    found = np.sqrt(np.mean(np.sum(verdict.residual_root[used, :3] ** 2, axis=1)))
    assert 1 < found < 0.3 * body_weight  # finite and sensible: neither nothing nor a missing step
