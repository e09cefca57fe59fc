"""Forces hidden in recordings that have them: whole stances, one of two feet, late halves, scaled down."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from solver.capture.capture import ForcePlate

REMOVED_N = 20.0  # more than this on a plate: it carries somebody; taken away: the frame's force is missing
SHORTEST_STANCE_S = 0.1
SHORTEST_DOUBLE_S = 0.03
HIDDEN_SHARE = 1 / 3  # of a trial's stances or double supports, and at least one
SCALED_DOWN = (0.3, 0.6)  # share removed


@dataclass(frozen=True)
class Stretch:
    """A time during which one plate's force is multiplied by what is kept of it."""

    plate: int
    start: float  # [s]
    end: float  # [s]
    kept: float = 0.0


Hider = Callable[[Sequence[Stretch], np.random.Generator], list[Stretch]]


def stances(plates: Sequence[ForcePlate]) -> list[Stretch]:
    """When each plate carries more than 20 N."""
    found = []
    for k, plate in enumerate(plates):
        pressed = np.concatenate([[False], plate.force_ground[:, 1] > REMOVED_N, [False]])
        edges = np.flatnonzero(pressed[1:] != pressed[:-1]).reshape(-1, 2)
        found += [
            Stretch(k, plate.start_time + a / plate.rate, plate.start_time + b / plate.rate)
            for a, b in edges
            if b - a > SHORTEST_STANCE_S * plate.rate
        ]
    return found


def whole_stances(measured: Sequence[Stretch], rng: np.random.Generator) -> list[Stretch]:
    return _some(measured, rng)


def one_of_two_feet(measured: Sequence[Stretch], rng: np.random.Generator) -> list[Stretch]:
    doubles = []
    for i, one in enumerate(measured):
        for other in measured[i + 1 :]:
            start, end = max(one.start, other.start), min(one.end, other.end)
            if other.plate != one.plate and end - start > SHORTEST_DOUBLE_S:
                doubles.append((Stretch(one.plate, start, end), Stretch(other.plate, start, end)))
    return [pair[rng.integers(2)] for pair in _some(doubles, rng)]


def late_halves(measured: Sequence[Stretch], rng: np.random.Generator) -> list[Stretch]:
    return [replace(s, start=(s.start + s.end) / 2) for s in _some(measured, rng)]


def scaled_down(measured: Sequence[Stretch], rng: np.random.Generator) -> list[Stretch]:
    return [replace(s, kept=1.0 - rng.uniform(*SCALED_DOWN)) for s in _some(measured, rng)]


def _some(items: Sequence, rng: np.random.Generator) -> list:
    chosen = rng.random(len(items)) < HIDDEN_SHARE
    if len(items) and not chosen.any():
        chosen[rng.integers(len(items))] = True
    return [item for item, wanted in zip(items, chosen, strict=True) if wanted]


KINDS: dict[str, Hider] = {
    "whole stances": whole_stances,
    "one of two feet": one_of_two_feet,
    "late halves": late_halves,
    "scaled down": scaled_down,
}


def hide(plates: Sequence[ForcePlate], hidden: Iterable[Stretch]) -> tuple[ForcePlate, ...]:
    """The recording as if those forces had not been measured, or not all of them."""
    kept = [np.ones(plate.samples) for plate in plates]
    for stretch in hidden:
        times = plates[stretch.plate].times
        kept[stretch.plate][(times >= stretch.start - 1e-9) & (times <= stretch.end + 1e-9)] = stretch.kept
    return tuple(
        replace(
            plate,
            force_ground=plate.force_ground * share[:, None],
            moment_ground=plate.moment_ground * share[:, None],
            cop_ground=np.where(share[:, None] > 0, plate.cop_ground, np.nan),
        )
        for plate, share in zip(plates, kept, strict=True)
    )
