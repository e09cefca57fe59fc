"""Scored frames, and the figures of a stretch of motion as rows."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Bool

from addb_viewer.benchmark.completing import completed
from addb_viewer.benchmark.errors import BenchmarkError
from addb_viewer.benchmark.metrics import LOADED_N, frame_errors
from addb_viewer.benchmark.task import Example, Predicted

HISTORY, STRIDE = (
    50,
    5,
)  # frames that have to count before a scored one, and every how many (the MLP's window)
PEEKING_N_PER_KG = 0.01  # a hundredth of what plates are good for; nobody predicts forces so well

Frames = Literal["scored", "all"]


@dataclass(frozen=True)
class Score:
    """The mean of one figure over a stretch's frames with one activity."""

    person_id: str
    subject_id: str
    trial_id: str
    activity: str
    metric: str
    mean: float
    frames: int


def scored_frames(counts: Bool[np.ndarray, " frames"]) -> Bool[np.ndarray, " frames"]:
    """Frames that count and whose window of every 5th of the last 50 frames counts: alike for all predictors.

    Args:
        counts: of consecutive frames.
    """
    scored = counts.copy()
    for back in range(STRIDE, HISTORY, STRIDE):
        scored[back:] &= counts[:-back]
        scored[:back] = False
    return scored


def scores_of(example: Example, predicted: Predicted, frames: Frames = "scored") -> Iterator[Score]:
    """A row for each figure and activity.

    Args:
        example: what was shown and measured.
        predicted: what a predictor said.
        frames: "scored", or "all" that count.

    Raises:
        BenchmarkError: the answer has wrong shapes; or it is the measured force, which nobody can predict.
    """
    counts = example.measured.counts
    chosen = scored_frames(counts) if frames == "scored" else counts
    if not chosen.any():
        return
    errors = frame_errors(example.measured, completed(example.seen, predicted), example.seen.skeleton)
    loaded = np.nansum(example.measured.force[..., 1], axis=1) > LOADED_N
    _refuse_peeking(errors["grf"][chosen & loaded], example)
    for activity in sorted(set(example.measured.activity[chosen])):
        rows = chosen & (example.measured.activity == activity)
        for metric, values in errors.items():
            there = values[rows][np.isfinite(values[rows])]
            if len(there):
                who = (example.person_id, example.subject_id, example.trial_id)
                yield Score(*who, str(activity), metric, float(there.mean()), len(there))


def _refuse_peeking(grf: np.ndarray, example: Example) -> None:
    if len(grf) and np.median(grf) < PEEKING_N_PER_KG:
        raise BenchmarkError(
            f"{example.trial_id}: half of the forces on loaded feet are predicted within "
            f"{PEEKING_N_PER_KG} N/kg. No motion tells that; the predictor has seen the forces."
        )
