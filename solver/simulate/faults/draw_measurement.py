"""Effects of measurement: the clock, the plates, the markers, and what was written down."""

from dataclasses import replace

import numpy as np

from solver.simulate.faults import clocks
from solver.simulate.faults.draw_markers import MARKERS
from solver.simulate.faults.draw_plates import PLATES
from solver.simulate.faults.drawing import Change, Hide, NoPlaceError, sign
from solver.simulate.faults.files import Recording
from solver.simulate.faults.hidden import REFERENCE_SIZE, Hidden
from solver.simulate.faults.worlds import GENERIC
from solver.skeleton.skeleton import Skeleton


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


def _clock_offset(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    offset = sign(rng) * size * REFERENCE_SIZE["clock_offset"]
    rate = recording.trials[0].plates[0].rate
    if rate >= 500:  # whole samples need no interpolation
        offset = round(offset * rate) / rate
    trials = tuple(clocks.late(t, offset) for t in recording.trials)
    return replace(recording, trials=trials), Hidden("clock_offset", "all", {"offset_s": offset}, size)


def _sample_rate(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    stretch = sign(rng) * size * REFERENCE_SIZE["sample_rate"]
    trials = tuple(clocks.stretched(t, stretch) for t in recording.trials)
    return replace(recording, trials=trials), Hidden("sample_rate", "all", {"stretch": stretch}, size)


def _filter(recording: Recording, size: float, rng: np.random.Generator) -> Change:
    # Its square, or twice the size would leave nothing of a walk.
    cutoff = float(REFERENCE_SIZE["filter_mismatch"] / np.sqrt(size))
    trials = tuple(clocks.low_passed(t, cutoff) for t in recording.trials)
    return replace(recording, trials=trials), Hidden("filter_mismatch", "all", {"cutoff_Hz": cutoff}, size)


CLOCKS: dict[str, Hide] = {
    "clock_offset": _clock_offset,
    "sample_rate": _sample_rate,
    "filter_mismatch": _filter,
}


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
