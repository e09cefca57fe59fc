"""What each frame tells by itself, some thousand frames at a time, whatever the length of the trial."""

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from jaxtyping import Float

FRAMES_AT_ONCE = 8192  # poses of a full body take 9 kB a frame; a trial of fewer frames is one piece


def spans(frames: int, most: int = FRAMES_AT_ONCE) -> list[slice]:
    """Neighbouring frames in pieces of `most` at most; a single piece, maybe empty, where that is enough."""
    pieces = max(1, -(-frames // most))
    edges = [frames * piece // pieces for piece in range(pieces + 1)]
    return [slice(low, high) for low, high in pairwise(edges)]


def by_frames(function: Callable[..., np.ndarray], *of_frames: np.ndarray) -> np.ndarray:
    """What `function` makes of arrays over frames, made piece by piece.

    Args:
        function: takes these arrays and gives one over the same frames; no frame depends on another.
        of_frames: one array or more, frames first.
    """
    frames = len(of_frames[0])
    pieces = spans(frames)
    if len(pieces) == 1:
        return function(*of_frames)
    whole: np.ndarray | None = None
    for piece in pieces:
        part = function(*(values[piece] for values in of_frames))
        if whole is None:
            whole = np.empty((frames, *part.shape[1:]), part.dtype)
        whole[piece] = part
    assert whole is not None
    return whole


def overlapping(frames: int, *, most: int, window: int, shared: int, align: int = 1) -> list[slice]:
    """Windows of equal length, each of which begins within the one before it.

    Args:
        frames: of the whole; up to `most` of them are a single window.
        most: see there.
        window: most frames of one of several.
        shared: frames that neighbours have in common, half a window at most.
        align: windows begin at multiples of it.
    """
    if frames <= most:
        return [slice(0, frames)]
    shared = min(shared, window // 2)
    count = -(-(frames - shared) // max(1, window - shared))
    starts = [(frames - shared) * k // count // align * align for k in range(count)]
    return [slice(a, b) for a, b in zip(starts, [*(a + shared for a in starts[1:]), frames], strict=True)]


def joined(
    parts: Sequence[Float[np.ndarray, "some *values"]], starts: Sequence[int]
) -> Float[np.ndarray, "all *values"]:
    """Overlapping neighbours as one: each passes into the next in the middle half of what they share.

    Args:
        parts: in order; no place is in more than two of them.
        starts: of each.
    """
    if len(parts) == 1:
        return parts[0]
    whole = np.empty((starts[-1] + len(parts[-1]), *parts[0].shape[1:]))
    whole[: len(parts[0])], end = parts[0], len(parts[0])
    for part, start in zip(parts[1:], starts[1:], strict=True):
        shared = end - start
        later = np.clip(2 * (np.arange(shared) + 0.5) / max(1, shared) - 0.5, 0.0, 1.0)
        before = whole[start:end]
        before += later.reshape(-1, *(1,) * (part.ndim - 1)) * (part[:shared] - before)
        end = start + len(part)
        whole[start + shared : end] = part[shared:]
    return whole
