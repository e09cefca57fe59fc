"""Smooth free time histories over stretches of trials: cubic B-splines that vanish where a stretch ends."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from scipy.interpolate import BSpline
from scipy.sparse import csc_array

from solver.diagnosis.causes.observed_trial import Scene

DEGREE = 3


@dataclass(frozen=True)
class Stretch:
    """Frames of one trial, and what is needed to count splines on them without the trial."""

    trial: str
    start: int
    end: int  # the first frame after
    frames: int  # of the whole trial
    rate: float  # [Hz]

    @property
    def seconds(self) -> float:
        """Its duration [s]."""
        return (self.end - self.start) / self.rate

    def widen(self, by_s: float) -> "Stretch":
        """By so much at both ends, within the trial [s]."""
        by = round(by_s * self.rate)
        return Stretch(
            self.trial, max(0, self.start - by), min(self.frames, self.end + by), self.frames, self.rate
        )

    def humps(self, spacing_s: float) -> Float[np.ndarray, "frames humps"]:
        """Evenly spaced splines over it, at all frames of the trial.

        They sum to one, but fall to zero towards both ends, as a contact's force does, unless the stretch
        goes on to that end of the trial.

        Args:
            spacing_s: wanted from knot to knot [s]; it is made to fit.
        """
        time_histories = np.zeros((self.frames, self.hump_count(spacing_s)))
        time_histories[self.start : self.end] = self.sparse_humps(spacing_s).toarray()
        return time_histories

    def sparse_humps(self, spacing_s: float) -> csc_array:
        """The same on its own frames alone, frames × humps: over minutes there are thousands."""
        pieces = self._pieces(spacing_s)
        knots = np.concatenate([np.zeros(DEGREE), np.arange(pieces + 1), np.full(DEGREE, pieces)])
        position = (np.arange(self.end - self.start) + 0.5) * pieces / (self.end - self.start)
        whole = csc_array(BSpline.design_matrix(position, knots, DEGREE))
        return whole[:, int(self.begins) : whole.shape[1] - int(self.ends)]

    def hump_count(self, spacing_s: float) -> int:
        """How many there are."""
        return self._pieces(spacing_s) + DEGREE - int(self.begins) - int(self.ends)

    @property
    def begins(self) -> bool:
        """Whether it begins within the trial."""
        return self.start > 0

    @property
    def ends(self) -> bool:
        """Whether it ends within the trial."""
        return self.end < self.frames

    def _pieces(self, spacing_s: float) -> int:
        return max(1, round(self.seconds / spacing_s))


def stretch_of(scene: Scene, start: int, end: int) -> Stretch:
    """Frames of a trial."""
    return Stretch(scene.name, start, end, scene.frames, scene.rate)


def join(stretches: Iterable[Stretch]) -> tuple[Stretch, ...]:
    """Stretches of one trial in order of time, those that overlap as one."""
    apart: list[Stretch] = []
    for s in sorted(stretches, key=lambda s: s.start):
        if apart and s.start < apart[-1].end:
            last = apart[-1]
            apart[-1] = Stretch(s.trial, last.start, max(s.end, last.end), s.frames, s.rate)
        else:
            apart.append(s)
    return tuple(apart)


def frames_of(stretches: Sequence[Stretch], scene: Scene) -> Bool[np.ndarray, " frames"]:
    """Which frames of a trial the stretches cover."""
    inside = np.zeros(scene.frames, dtype=bool)
    for s in stretches:
        if s.trial == scene.name:
            inside[s.start : s.end] = True
    return inside
