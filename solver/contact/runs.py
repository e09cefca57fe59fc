"""Runs of True in a flag per frame."""

import numpy as np
from jaxtyping import Bool


def runs(flags: Bool[np.ndarray, " frames"]) -> list[tuple[int, int]]:
    """The runs as (first frame, first frame after it)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return [(int(start), int(end)) for start, end in edges.reshape(-1, 2)]


def without_short_gaps(flags: Bool[np.ndarray, " frames"], shortest: int) -> Bool[np.ndarray, " frames"]:
    """Gaps between two runs that are shorter than `shortest` frames count as True."""
    closed = flags.copy()
    for start, end in runs(~flags):
        if start > 0 and end < len(flags) and end - start < shortest:
            closed[start:end] = True
    return closed
