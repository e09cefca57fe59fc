"""Stretches of frames that have the same label."""

from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Int


def true_runs(flags: Bool[np.ndarray, " frames"]) -> list[tuple[int, int]]:
    """Runs of True as (start, end); frame `end` is the first that no longer belongs."""
    return [(start, end) for start, end, _ in labelled_runs(flags.astype(np.int64))]


def labelled_runs(labels: Int[np.ndarray, " frames"]) -> list[tuple[int, int, int]]:
    """Runs of the same label above 0 as (start, end, label)."""
    edges = np.flatnonzero(np.diff(labels, prepend=-1, append=-1)).tolist()
    return [(start, end, int(labels[start])) for start, end in pairwise(edges) if labels[start] > 0]
