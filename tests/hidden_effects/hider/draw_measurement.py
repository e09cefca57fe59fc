"""Effects of measurement: the clock, the plates, the markers, and what was written down."""

from dataclasses import replace

import numpy as np

from solver.skeleton.skeleton import Skeleton
from tests.hidden_effects.hider.draw_clocks import CLOCKS
from tests.hidden_effects.hider.draw_markers import MARKERS
from tests.hidden_effects.hider.draw_plates import PLATES
from tests.hidden_effects.hider.drawing import Change, Hide, NoPlaceError, sign
from tests.hidden_effects.hider.files import Recording
from tests.hidden_effects.hider.hidden import REFERENCE_SIZE, Hidden
from tests.hidden_effects.hider.worlds import GENERIC


def hide_measurement(recording: Recording, id: str, size: float, rng: np.random.Generator) -> Change:
    """Put one effect into every trial that it concerns.

    Args:
        recording: true.
        id: of the catalogue.
        size: in reference sizes.
        rng: draws target, sign and direction.

    Raises:
        NoPlaceError: nothing to change.
    """
    return MEASUREMENT[id](recording, size, rng)


def _subject_mass(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    if recording.mass_kg is None:
        raise NoPlaceError("no mass entered")
    factor = 1 + sign(rng) * size * REFERENCE_SIZE["subject_mass"]
    model = recording.model
    if model and model.name != GENERIC:
        model = _weighing(model, 1 / factor)
    changed = replace(recording, mass_kg=recording.mass_kg / factor, model=model)
    return changed, Hidden("subject_mass", "all", {"mass_factor": factor}, size)


MEASUREMENT: dict[str, Hide] = {**CLOCKS, **PLATES, "subject_mass": _subject_mass, **MARKERS}


def _weighing(model: Skeleton, factor: float) -> Skeleton:
    bodies = tuple(
        replace(b, mass=b.mass * factor, inertia_body=b.inertia_body * factor) for b in model.bodies
    )
    return replace(model, bodies=bodies)
