"""Point masses whose every force is known."""

from collections.abc import Callable

import numpy as np
import pytest

from solver.dynamics.com_trajectory import ComData

GRAVITY = np.array([0.0, -9.80665, 0.0])


def _stepped(acceleration: np.ndarray, rate: float) -> np.ndarray:
    """Positions from semi-implicit Euler steps, one frame at a time."""
    position, velocity = np.array([0.3, 1.0, -0.2]), np.array([0.5, 0.0, 0.02])
    positions = []
    for a in acceleration:
        positions.append(position)
        velocity = velocity + a / rate
        position = position + velocity / rate
    return np.array(positions)


@pytest.fixture
def walker() -> Callable[..., ComData]:
    """A point mass that walks at two steps a second; its centre of mass obeys the forces exactly."""

    def make(frames: int, *, rate: float = 100.0, mass_kg: float = 81.0) -> ComData:
        phase = 2 * np.pi * 2.0 * np.arange(frames) / rate
        sway = np.stack([1.5 * np.sin(phase), 2.5 * np.cos(phase), 0.6 * np.sin(phase / 2)], axis=1)
        return ComData(
            com_ground=_stepped(sway, rate),
            force_ground=mass_kg * (sway - GRAVITY),
            observed=np.ones(frames, dtype=bool),
            rate=rate,
            gravity=GRAVITY,
        )

    return make


@pytest.fixture
def unseen_steps() -> Callable[[int, float], np.ndarray]:
    """True on the second half of every other second, as when one foot misses the plate again and again."""

    def make(frames: int, rate: float) -> np.ndarray:
        return (np.arange(frames) / rate % 2.0) >= 1.5

    return make
