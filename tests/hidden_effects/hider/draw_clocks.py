"""Effects of the clock and of filters, drawn."""

from dataclasses import replace

import numpy as np

from tests.hidden_effects.hider import clocks
from tests.hidden_effects.hider.drawing import Change, Hide, sign
from tests.hidden_effects.hider.files import Recording
from tests.hidden_effects.hider.hidden import REFERENCE_SIZE, Hidden


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
