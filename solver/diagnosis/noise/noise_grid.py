"""K at every pair of its unknown scales, and the way to the pair that suits a hypothesis best."""

from collections.abc import Callable
from typing import Protocol, TypeVar

import numpy as np

from solver.diagnosis.noise.noise_scales import Basis, NoiseScale

MODEL_SCALE_STD = 0.7  # logarithm: how much such errors differ between recordings
# of model errors, between which their scale is sought, for every hypothesis anew
MODEL_SCALES = (0.09, 0.125, 0.18, 0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0)
# of how far soft tissue slides at most; sought likewise. More would take in what is wrong
SLACKS = (0.5, 0.7, 1.0)
SLACK_STD = 0.5  # logarithm: how much persons differ in that


# of slack and of model error: each up and down, and one for the other
STEPS = ((0, -1), (0, 1), (1, 0), (-1, 0), (1, -1), (-1, 1))


class AtNoiseScale(Protocol):
    """Whatever was fitted at a noise scale."""

    @property
    def noise_scale(self) -> NoiseScale:
        """Where."""

    @property
    def log_evidence(self) -> float:
        """Log density of the residual there [nats]."""


Fitted = TypeVar("Fitted", bound=AtNoiseScale)


class NoiseGrid:
    """Rungs by their slack and by their scale of model errors, both ascending."""

    def __init__(self, basis: Basis) -> None:
        self._rows = [[basis.noise_scale(s, h, _log_prior(s, h)) for s in MODEL_SCALES] for h in SLACKS]

    @property
    def noise_scales(self) -> list[NoiseScale]:
        """From little slack up, each from small model errors up."""
        return [noise_scale for row in self._rows for noise_scale in row]

    def nearest(self, scale: float, slack: float) -> NoiseScale:
        """The noise scale whose scales differ least, by a factor."""
        return min(
            self.noise_scales, key=lambda r: abs(np.log(r.slack / slack)) + abs(np.log(r.scale / scale))
        )

    def around(self, noise_scale: NoiseScale) -> list[NoiseScale]:
        """A noise scale and its neighbours."""
        i, k = self._place(noise_scale)
        places = [(i, k), *((i + di, k + dk) for di, dk in STEPS)]
        return [self._rows[a][b] for a, b in places if self._is_noise_scale(a, b)]

    def best(self, fitted: Callable[[NoiseScale], Fitted], near: NoiseScale | None) -> Fitted:
        """The fit of most evidence, by steps to neighbours as long as these are better.

        Args:
            fitted: at a noise scale.
            near: where the climb begins; None: at the usual slack, at its best level of model error.
        """
        usual = self.nearest(1.0, 1.0).slack
        begin = [r for r in self.noise_scales if r.slack == usual] if near is None else [near]
        best = max((fitted(r) for r in begin), key=lambda f: f.log_evidence)
        tried = {self._place(r) for r in begin}
        while True:
            for step in STEPS:
                further = self._along(step, best, fitted, tried)
                if further is not best:
                    best = further
                    break
            else:
                return best

    def _along(
        self,
        step: tuple[int, int],
        best: Fitted,
        fitted: Callable[[NoiseScale], Fitted],
        tried: set[tuple[int, int]],
    ) -> Fitted:
        """The last fit on the way in one direction that is better than the one before."""
        i, k = self._place(best.noise_scale)
        while True:
            i, k = i + step[0], k + step[1]
            if (i, k) in tried or not self._is_noise_scale(i, k):
                return best
            tried.add((i, k))
            further = fitted(self._rows[i][k])
            if further.log_evidence <= best.log_evidence:
                return best
            best = further

    def _place(self, noise_scale: NoiseScale) -> tuple[int, int]:
        return next((i, row.index(noise_scale)) for i, row in enumerate(self._rows) if noise_scale in row)

    def _is_noise_scale(self, i: int, k: int) -> bool:
        return 0 <= i < len(self._rows) and 0 <= k < len(self._rows[0])


def _log_prior(scale: float, slack: float) -> float:
    """Of the scale of model errors and of the slack [nats]."""
    apart = np.log(scale) / MODEL_SCALE_STD, np.log(slack) / SLACK_STD
    return float(-0.5 * (apart[0] ** 2 + apart[1] ** 2))
