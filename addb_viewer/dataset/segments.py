"""Where a trial is cut: at stretches that must not be used, and where a piece would be too long."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Int

from solver.common.runs import runs

LONGEST = 2000  # frames; the dataset paper's
SHORTEST = 12  # frames; fewer are left out, 12 are kept


@dataclass(frozen=True)
class Segment:
    """Frames start to end − 1 of a trial, on the release's grid."""

    start: int
    end: int

    @property
    def frames(self) -> int:
        """How many."""
        return self.end - self.start

    @property
    def rows(self) -> slice:
        """Of arrays with a row a frame."""
        return slice(self.start, self.end)


@dataclass(frozen=True)
class Cuts:
    """What becomes of a trial's frames."""

    kept: tuple[Segment, ...]
    erroneous: tuple[Segment, ...]
    too_short: tuple[Segment, ...]

    def number(self, frames: int) -> Int[np.ndarray, " frames"]:
        """Of the segment that each frame is in, from 0; −1 for frames in none.

        Args:
            frames: of the trial.
        """
        number = np.full(frames, -1)
        for k, segment in enumerate(self.kept):
            number[segment.rows] = k
        return number


def cuts_of(erroneous: Bool[np.ndarray, " frames"]) -> Cuts:
    """Spans between erroneous stretches, each in as few pieces as may be, as even as may be.

    Args:
        erroneous: frames that must not be used.
    """
    pieces = [piece for start, end in runs(~erroneous) for piece in evenly_cut(start, end)]
    return Cuts(
        tuple(piece for piece in pieces if piece.frames >= SHORTEST),
        tuple(Segment(start, end) for start, end in runs(erroneous)),
        tuple(piece for piece in pieces if piece.frames < SHORTEST),
    )


def evenly_cut(start: int, end: int) -> tuple[Segment, ...]:
    """ceil(n / 2000) pieces of floor or ceil frames, the longer ones first.

    Args:
        start: first frame of the span.
        end: the first after it.
    """
    frames = end - start
    pieces = -(-frames // LONGEST)
    sizes = [frames // pieces + (k < frames % pieces) for k in range(pieces)]
    borders = np.cumsum([start, *sizes]).tolist()
    return tuple(Segment(a, b) for a, b in pairwise(borders))
