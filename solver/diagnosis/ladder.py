"""K at every pair of its unknown scales, and the way to the pair that suits a hypothesis best."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, TypeVar

import numpy as np
from jaxtyping import Float
from scipy.linalg import cholesky, solve_triangular
from scipy.linalg.lapack import dpotri

from solver.diagnosis.settings import DiagnosisSettings

# of slack and of model error: each up and down, and one for the other
STEPS = ((0, -1), (0, 1), (1, 0), (-1, 0), (1, -1), (-1, 1))


@dataclass(frozen=True, eq=False)
class Covariances:
    """What K is made of, over the rows of all trials."""

    residual: Float[np.ndarray, " rows"]
    fixed: Float[np.ndarray, "rows rows"]  # of markers, plates' noise and inertias
    slack: Float[np.ndarray, "rows rows"]  # of flesh and laboratory, at scale 1
    model: Float[np.ndarray, "rows rows"]  # at scale 1


@dataclass(eq=False)
class Rung:
    """K at one scale of the model error and one of the slack; factored once it is asked for."""

    scale: float
    slack: float  # of flesh on the bones and of plates in the laboratory; 1 is usual
    of: Covariances
    log_prior: float  # of both scales

    @property
    def residual(self) -> Float[np.ndarray, " rows"]:
        """The same at every rung."""
        return self.of.residual

    @cached_property
    def factor(self) -> Float[np.ndarray, "rows rows"]:
        """Lower Cholesky."""
        K = self.of.fixed + self.slack**2 * self.of.slack + self.scale**2 * self.of.model
        return np.asarray(cholesky(K, lower=True, overwrite_a=True, check_finite=False))

    @cached_property
    def y(self) -> Float[np.ndarray, " rows"]:
        """Whitened residual."""
        return self.whitened(self.residual)

    @cached_property
    def constant(self) -> float:
        """Log density of whatever doesn't depend on candidates, but for ½ yᵀy."""
        return float(self.log_prior - np.log(np.diag(self.factor)).sum())

    def whitened(self, columns: Float[np.ndarray, "rows *columns"]) -> Float[np.ndarray, "rows *columns"]:
        """L⁻¹ columns."""
        return np.asarray(solve_triangular(self.factor, columns, lower=True, check_finite=False))

    @cached_property
    def precision(self) -> Float[np.ndarray, "rows rows"]:
        """K⁻¹."""
        lower, _ = dpotri(self.factor, lower=1)
        return np.asarray(np.tril(lower) + np.tril(lower, -1).T)


class AtRung(Protocol):
    """Whatever was fitted at a rung."""

    @property
    def rung(self) -> Rung:
        """Where."""

    @property
    def log_evidence(self) -> float:
        """Log density of the residual there [nats]."""


Fitted = TypeVar("Fitted", bound=AtRung)


class Ladder:
    """Rungs by their slack and by their scale of model errors, both ascending."""

    def __init__(self, of: Covariances, settings: DiagnosisSettings) -> None:
        self._rows = [
            [Rung(s, h, of, settings.log_prior_of_scales(s, h)) for s in settings.model_scales]
            for h in settings.slacks
        ]

    @property
    def rungs(self) -> list[Rung]:
        """From little slack up, each from small model errors up."""
        return [rung for row in self._rows for rung in row]

    def nearest(self, scale: float, slack: float) -> Rung:
        """The rung whose scales differ least, by a factor."""
        return min(
            self.rungs,
            key=lambda r: abs(np.log(r.slack / slack)) + abs(np.log(r.scale / scale)),
        )

    def best(self, fitted: Callable[[Rung], Fitted], near: Rung | None) -> Fitted:
        """The fit of most evidence, by steps to neighbours as long as these are better.

        Args:
            fitted: at a rung.
            near: where the climb begins; None: at the usual slack, at its best level of model error.
        """
        if near is None:
            usual = self.nearest(1.0, 1.0).slack
            best = max((fitted(r) for r in self.rungs if r.slack == usual), key=lambda s: s.log_evidence)
        else:
            best = fitted(near)
        below: set[tuple[int, int]] = set()
        while True:
            i, k = self._place(best.rung)
            for di, dk in STEPS:
                better = False
                while (at := (i + di, k + dk)) not in below and self._is_rung(*at):
                    tried = fitted(self._rows[at[0]][at[1]])
                    below.add(at)
                    if tried.log_evidence <= best.log_evidence:
                        break
                    best, better, (i, k) = tried, True, at
                if better:
                    break
            else:
                return best

    def _place(self, rung: Rung) -> tuple[int, int]:
        return next((i, row.index(rung)) for i, row in enumerate(self._rows) if rung in row)

    def _is_rung(self, i: int, k: int) -> bool:
        return 0 <= i < len(self._rows) and 0 <= k < len(self._rows[0])
