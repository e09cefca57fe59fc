"""Stretches of consecutive True in a series of flags."""

import numpy as np
from jaxtyping import Bool


def runs(flags: Bool[np.ndarray, " frames"]) -> list[tuple[int, int]]:
    """Runs of True as (start, end); frame `end` is the first that no longer belongs."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return [(int(start), int(end)) for start, end in edges.reshape(-1, 2)]
