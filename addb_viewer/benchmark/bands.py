"""How wrong a predictor's forces are, by how much a foot is told to carry: its standard deviations."""

from collections import defaultdict
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import islice

import numpy as np
from jaxtyping import Float, Int

from addb_viewer.benchmark.scoring import scored_frames
from addb_viewer.benchmark.task import Example, Predicted

EDGES_N_PER_KG = (0.3, 3.0, 7.0, 11.0)  # of the told vertical force, between bins
FEWEST_FRAMES = 20  # of a bin, or all bins' error stands for it
MOST_STRETCHES = 60


@dataclass(frozen=True)
class ErrorBands:
    """Root mean square errors of a foot's force over persons who are not tested, each weighing alike."""

    sd: Float[np.ndarray, "bins 2"]  # of a level component, of the vertical one [N/kg]

    def of(
        self, force: Float[np.ndarray, "frames feet 3"], mass_kg: float
    ) -> Float[np.ndarray, "frames feet 3"]:
        """Standard deviations of told forces [N].

        Args:
            force: told [N].
            mass_kg: of the shown body.
        """
        level, vertical = np.moveaxis(self.sd[_bins(force, mass_kg)], -1, 0)
        return mass_kg * np.stack([level, vertical, level], axis=-1)


def error_bands(answer: Callable[[Example], Predicted], examples: Iterable[Example]) -> ErrorBands | None:
    """What a predictor's errors are on some persons; None where nothing of them was measured.

    Args:
        answer: of the predictor, by what it is shown of the example.
        examples: of persons who are not tested, MOST_STRETCHES at most; best of such that it has not learnt.
    """
    bins = len(EDGES_N_PER_KG) + 1
    sums: dict[str, np.ndarray] = defaultdict(lambda: np.zeros((bins, 3)))
    for example in islice(examples, MOST_STRETCHES):
        counts = scored_frames(example.measured.counts)
        if not counts.any():
            continue
        force = answer(example).force[counts]
        square = ((force - example.measured.force[counts]) / example.measured.mass_kg) ** 2
        there = np.isfinite(square).all(axis=2)
        at = _bins(force, example.seen.mass_kg)[there]
        own = square[there]
        values = np.stack([np.ones(len(at)), own[:, [0, 2]].mean(axis=1), own[:, 1]], axis=1)
        np.add.at(sums[example.person_id], at, values)
    if not sums:
        return None
    return ErrorBands(np.sqrt(_over_persons(np.stack(list(sums.values())))))


def _over_persons(sums: Float[np.ndarray, "persons bins 3"]) -> Float[np.ndarray, "bins 2"]:
    """Mean squares: over frames of a person, then over persons that have frames in the bin."""
    whole = sums.sum(axis=1, keepdims=True)
    overall = (whole[..., 1:] / np.maximum(whole[..., :1], 1.0)).mean(axis=(0, 1))
    frames, squares = sums[..., :1], sums[..., 1:]
    there = (frames > 0).astype(float)
    means = (squares / np.maximum(frames, 1.0)).sum(axis=0) / np.maximum(there.sum(axis=0), 1.0)
    return np.where(frames.sum(axis=0) >= FEWEST_FRAMES, means, overall)


def _bins(force: Float[np.ndarray, "frames feet 3"], mass_kg: float) -> Int[np.ndarray, "frames feet"]:
    return np.searchsorted(EDGES_N_PER_KG, force[..., 1] / mass_kg)
