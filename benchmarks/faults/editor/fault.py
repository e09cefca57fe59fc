"""What an edit did: the truth of a case."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from benchmarks.faults.editor.recording import Recording, Trial


class NoPlaceError(Exception):
    """This recording has no place for this fault."""


@dataclass(frozen=True)
class Fault:
    """One fault in one recording; plates are counted from 1, as people count them."""

    what: str  # in plain words, with its size
    size: dict[str, float] = field(default_factory=dict)  # by name with unit
    trials: tuple[str, ...] = ()  # that have it
    plate: int | None = None
    markers: tuple[str, ...] = ()
    times_s: tuple[float, float] | None = None  # of the only stretch that has it


Edit = Callable[[Recording, np.random.Generator], tuple[Recording, Fault]]

USED_S = 0.2  # a plate that is loaded for less tells too little of itself
STANCE_S = 0.3


def used_plates(trial: Trial) -> list[int]:
    """Plates, counted from 0, that bear somebody for long enough."""
    return [k for k, p in enumerate(trial.plates) if p.loaded.sum() / trial.force_rate > USED_S]


def drawn_plate(recording: Recording, rng: np.random.Generator) -> int:
    """A plate, counted from 0, that is used in all trials."""
    shared = set.intersection(*(set(used_plates(trial)) for trial in recording.trials))
    if not shared:
        raise NoPlaceError("no plate is used in all trials")
    return int(rng.choice(sorted(shared)))


def stretches(mask: np.ndarray) -> list[tuple[int, int]]:
    """First and end of each run of True."""
    edges = np.flatnonzero(np.diff(np.r_[False, mask, False].astype(int)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
