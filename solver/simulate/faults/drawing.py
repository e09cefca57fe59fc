"""What every draw of an effect needs: its type, chance, and which markers ride on which segment."""

from collections.abc import Callable

import numpy as np

from solver.capture.capture import Capture
from solver.simulate.faults.files import Recording
from solver.simulate.faults.hidden import Hidden

Change = tuple[Recording, Hidden]
Hide = Callable[[Recording, float, np.random.Generator], Change]
FEWEST_MARKERS = 3  # that make a frame


class NoPlaceError(Exception):
    """The recording has nothing that this effect could change."""


def sign(rng: np.random.Generator) -> float:
    return float(rng.choice([-1.0, 1.0]))


def direction(rng: np.random.Generator) -> np.ndarray:
    vector = rng.standard_normal(3)
    return vector / np.linalg.norm(vector)


def one_trial(recording: Recording, rng: np.random.Generator) -> Capture:
    return recording.trials[int(rng.integers(len(recording.trials)))]


def segments(recording: Recording, trial: Capture) -> dict[str, list[str]]:
    """Segments with markers enough to make a frame, and these markers."""
    groups: dict[str, list[str]] = {}
    for name in trial.markers.names:
        if name in recording.marker_bodies:
            groups.setdefault(recording.marker_bodies[name], []).append(name)
    return {body: names for body, names in groups.items() if len(names) >= FEWEST_MARKERS}
