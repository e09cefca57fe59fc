"""A synthetic body that swings its joints, with the markers of the crane."""

import numpy as np
import pytest

from solver.capture.capture import Markers
from solver.skeleton.forward import marker_positions

RATE = 100.0
FRAMES = 300


@pytest.fixture(scope="session")
def swinging(crane):
    """Three seconds of the crane; every dof a sine of its own, 1 mm of noise on every marker."""
    rng = np.random.default_rng(8)
    t = np.arange(FRAMES)[:, None] / RATE
    q = crane.default_q + 0.5 * np.sin(2 * np.pi * rng.uniform(0.3, 1.2, len(crane.dofs)) * t)
    x = marker_positions(crane, q)
    return Markers(crane.marker_names, x + rng.normal(0, 0.001, x.shape), RATE)
