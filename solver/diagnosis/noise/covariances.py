"""What the balance's covariance K is made of."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float
from scipy.linalg import block_diag


@dataclass(frozen=True, eq=False)
class Covariances:
    """What K is made of."""

    residual: Float[np.ndarray, " rows"]
    fixed: tuple[Float[np.ndarray, "own own"], ...]  # C of each trial: of markers and plates
    model: tuple[Float[np.ndarray, "own own"], ...]  # M of each trial, at scale 1
    shared: Float[np.ndarray, "rows shared"]  # H: inertias, what every laboratory is off by
    tissue: Float[np.ndarray, "rows columns"]  # S: of soft tissue, at scale 1

    def at(self, scale: float, slack: float) -> Float[np.ndarray, "rows rows"]:
        """K."""
        return self._constant + slack**2 * self._slack + scale**2 * self._model

    def variance(self, scale: float, slack: float) -> Float[np.ndarray, " rows"]:
        """Its diagonal."""
        own = [np.diag(C) + scale**2 * np.diag(M) for C, M in zip(self.fixed, self.model, strict=True)]
        shared = (self.shared**2).sum(axis=1) + slack**2 * (self.tissue**2).sum(axis=1)
        return np.asarray(np.concatenate(own) + shared)

    @cached_property
    def trials(self) -> tuple[slice, ...]:
        """Rows of each."""
        ends = np.cumsum([len(C) for C in self.fixed]).tolist()
        return tuple(slice(end - len(C), end) for C, end in zip(self.fixed, ends, strict=True))

    @cached_property
    def _constant(self) -> Float[np.ndarray, "rows rows"]:
        return np.asarray(block_diag(*self.fixed) + self.shared @ self.shared.T)

    @cached_property
    def _slack(self) -> Float[np.ndarray, "rows rows"]:
        return self.tissue @ self.tissue.T

    @cached_property
    def _model(self) -> Float[np.ndarray, "rows rows"]:
        return np.asarray(block_diag(*self.model))
