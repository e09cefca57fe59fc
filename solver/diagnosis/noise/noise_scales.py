"""K at one pair of its unknown scales: what whitens rows by it, and what weights them by its inverse.

    K(s, h) = blocks of trials (C + s² M) + H Hᵀ + h² S Sᵀ

Few rows are factored as they are. Many are turned once into the basis X of each trial in which C is the
identity and M diagonal (Xᵀ C X = I, Xᵀ M X = Λ); there K is diagonal, D = I + s² Λ, but for the columns that
trials share, Z = Xᵀ [H, h S]. With D^-½ Z = U V ᵀ, U having orthogonal columns of squared lengths g,

    K^-½ = (I − U diag((1 − (1 + g)^-½) / g) Uᵀ) D^-½      K⁻¹ = D^-½ (I − U diag(1 / (1 + g)) Uᵀ) D^-½

so that a pair of scales costs the eigenvectors of a small matrix, and a column as many products as there are
shared columns that matter.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float
from scipy.linalg import block_diag, cholesky, eigh, solve_triangular
from scipy.linalg.blas import dsyrk
from scipy.linalg.lapack import dpotri

from solver.diagnosis.bounded_cache import Memory

ALL = slice(None)
MOST_KEPT_BYTES = 1000e6  # of what noise scales are made of, and of what terms and places look like there
LEAST_SHARED = 1e-10  # of the variance of a direction, that shared columns add to it: rounding


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


@dataclass(frozen=True, eq=False)
class Seen:
    """Columns as a noise scale sees them, on the rows of some trials.

    Columnsᵀ K⁻¹ other columns is the product of what is scaled, on the rows that both have, less that of what
    lies along directions that trials share.
    """

    rows: slice
    scaled: Float[np.ndarray, "own some"]
    along: Float[np.ndarray, "directions some"]

    @property
    def nbytes(self) -> int:
        """That it takes."""
        return self.scaled.nbytes + self.along.nbytes

    def times(self, other: "Seen") -> Float[np.ndarray, "some others"]:
        """Columnsᵀ K⁻¹ other columns."""
        first, last = max(self.rows.start, other.rows.start), min(self.rows.stop, other.rows.stop)
        shared = self.along.T @ other.along
        if first >= last:
            return np.asarray(-shared)
        own, others = (s.scaled[first - s.rows.start : last - s.rows.start] for s in (self, other))
        return np.asarray(own.T @ others - shared)


class Basis:
    """Coordinates in which noise scales whiten and weigh: the rows themselves where these are few."""

    def __init__(self, of: Covariances) -> None:
        self.of = of
        self.kept = Memory(MOST_KEPT_BYTES)

    @cached_property
    def residual(self) -> Float[np.ndarray, " rows"]:
        """In these coordinates."""
        return self.transform(self.of.residual)

    def noise_scale(self, scale: float, slack: float, log_prior: float) -> "NoiseScale":
        """K at a pair of scales."""
        return WholeNoiseScale(scale, slack, log_prior, self)

    def transform(
        self, columns: Float[np.ndarray, "own *some"], span: slice = ALL
    ) -> Float[np.ndarray, "own *some"]:
        """Rows of whole trials, all of them unless told, in these coordinates."""
        return columns

    def rows(self, weighted: Float[np.ndarray, "rows *some"]) -> Float[np.ndarray, "rows *some"]:
        """What was weighted in these coordinates, by rows."""
        return weighted


class TrialsBasis(Basis):
    """Of each trial one in which C is the identity and M diagonal."""

    @cached_property
    def _X(self) -> tuple[Float[np.ndarray, "own own"], ...]:
        return tuple(X for _, X in self._pairs)

    @cached_property
    def _pairs(self) -> list[tuple[Float[np.ndarray, " own"], Float[np.ndarray, "own own"]]]:
        of = self.of
        return [eigh(M, C, driver="gvd", check_finite=False) for C, M in zip(of.fixed, of.model, strict=True)]

    @cached_property
    def model(self) -> Float[np.ndarray, " rows"]:
        """Diagonal of M at scale 1."""
        return np.maximum(np.concatenate([values for values, _ in self._pairs]), 0.0)

    @cached_property
    def shared(self) -> Float[np.ndarray, "rows shared"]:
        """H."""
        return self.transform(self.of.shared)

    @cached_property
    def tissue(self) -> Float[np.ndarray, "rows columns"]:
        """S at scale 1."""
        return self.transform(self.of.tissue)

    @cached_property
    def half_log_det(self) -> float:
        """Of all C."""
        return -sum(float(np.linalg.slogdet(X)[1]) for X in self._X)

    def noise_scale(self, scale: float, slack: float, log_prior: float) -> "NoiseScale":
        """K at a pair of scales."""
        return TurnedNoiseScale(scale, slack, log_prior, self)

    def transform(
        self, columns: Float[np.ndarray, "own *some"], span: slice = ALL
    ) -> Float[np.ndarray, "own *some"]:
        """Rows of whole trials, all of them unless told, in these coordinates."""
        begin = span.start or 0
        parts = [
            X.T @ columns[own.start - begin : own.stop - begin]
            for own, X in zip(self.of.trials, self._X, strict=True)
            if span == ALL or span.start <= own.start < span.stop
        ]
        return np.concatenate(parts)

    def rows(self, weighted: Float[np.ndarray, "rows *some"]) -> Float[np.ndarray, "rows *some"]:
        """What was weighted in these coordinates, by rows."""
        pairs = zip(self.of.trials, self._X, strict=True)
        return np.concatenate([X @ weighted[own] for own, X in pairs])

    def of_trial(self, span: slice) -> tuple[slice, Float[np.ndarray, "some own"]]:
        """Rows of the trial that a span lies in, and those of X that belong to the span."""
        own, X = next(p for p in zip(self.of.trials, self._X, strict=True) if p[0].stop > span.start)
        return own, X[span.start - own.start : span.stop - own.start]


@dataclass(eq=False)
class NoiseScale(ABC):
    """K at one scale of the model error and one of the slack; factored once it is asked for.

    Columns and the residual are those of the basis, but for `precision_at` and `covariance`.
    """

    scale: float
    slack: float  # of soft tissue on the bones; 1 is usual
    log_prior: float  # of both scales
    basis: Basis

    @property
    def residual(self) -> Float[np.ndarray, " rows"]:
        """The same at every noise scale."""
        return self.basis.residual

    @property
    def covariance(self) -> Float[np.ndarray, "rows rows"]:
        """K by rows."""
        return self.basis.of.at(self.scale, self.slack)

    @cached_property
    def seen_residual(self) -> Seen:
        """The residual, as products with it need it."""
        return self.seen(self.residual[:, None], slice(0, len(self.residual)))

    @cached_property
    def square(self) -> float:
        """Residualᵀ K⁻¹ residual."""
        return float(self.seen_residual.times(self.seen_residual)[0, 0])

    @cached_property
    def constant(self) -> float:
        """Log density of whatever doesn't depend on candidates, but for ½ yᵀy."""
        return self.log_prior - self.half_log_det

    def precision_at(self, span: slice) -> Float[np.ndarray, "own own"]:
        """K⁻¹ by rows that lie in one trial; kept."""
        what = f"precision of rows {span.start} to {span.stop}"
        return self.basis.kept.get(lambda: self._precision_at(span), what, self)

    @property
    @abstractmethod
    def half_log_det(self) -> float:
        """Of K."""

    @abstractmethod
    def whiten(self, columns: Float[np.ndarray, "rows *some"]) -> Float[np.ndarray, "rows *some"]:
        """W columns, with some W for which Wᵀ W is K⁻¹."""

    @abstractmethod
    def seen(self, columns: Float[np.ndarray, "own some"], span: slice) -> Seen:
        """Columns on the rows of some trials, as their products with others need them."""

    @abstractmethod
    def times_precision(
        self, columns: Float[np.ndarray, "own *some"], span: slice = ALL
    ) -> Float[np.ndarray, "own *some"]:
        """K⁻¹ columns, of columns on the rows of some trials, on these rows."""

    @abstractmethod
    def _precision_at(self, span: slice) -> Float[np.ndarray, "own own"]: ...


class WholeNoiseScale(NoiseScale):
    """K factored as it is."""

    @property
    def factor(self) -> Float[np.ndarray, "rows rows"]:
        """Lower Cholesky; kept."""
        return self.basis.kept.get(
            lambda: cholesky(self.covariance, lower=True, overwrite_a=True, check_finite=False),
            "factor",
            self,
        )

    @property
    def half_log_det(self) -> float:
        """Of K."""
        return float(np.log(np.diag(self.factor)).sum())

    def whiten(self, columns: Float[np.ndarray, "rows *some"]) -> Float[np.ndarray, "rows *some"]:
        """L⁻¹ columns."""
        return np.asarray(solve_triangular(self.factor, columns, lower=True, check_finite=False))

    def seen(self, columns: Float[np.ndarray, "own some"], span: slice) -> Seen:
        """L⁻¹ columns; nothing is shared beside that."""
        whole = np.zeros((len(self.residual), columns.shape[1]))
        whole[span] = columns
        return Seen(slice(0, len(whole)), self.whiten(whole), np.zeros((0, columns.shape[1])))

    def times_precision(
        self, columns: Float[np.ndarray, "own *some"], span: slice = ALL
    ) -> Float[np.ndarray, "own *some"]:
        """K⁻¹ columns, of columns on the rows of some trials, on these rows."""
        return np.asarray(self._precision[span, span] @ columns)

    @property
    def _precision(self) -> Float[np.ndarray, "rows rows"]:
        return self.basis.kept.get(self._inverse, "precision", self)

    def _inverse(self) -> Float[np.ndarray, "rows rows"]:
        lower, _ = dpotri(self.factor, lower=1)
        return np.asarray(np.tril(lower) + np.tril(lower, -1).T)

    def _precision_at(self, span: slice) -> Float[np.ndarray, "own own"]:
        return np.ascontiguousarray(self._precision[span, span])


class TurnedNoiseScale(NoiseScale):
    """K in the trials' bases."""

    basis: TrialsBasis

    @cached_property
    def deviation(self) -> Float[np.ndarray, " rows"]:
        """√D."""
        return np.sqrt(1.0 + self.scale**2 * self.basis.model)

    @cached_property
    def shared(self) -> tuple[Float[np.ndarray, "rows directions"], Float[np.ndarray, " directions"]]:
        """U and g."""
        Z = np.concatenate([self.basis.shared, self.slack * self.basis.tissue], axis=1)
        Z /= self.deviation[:, None]
        g, V = np.linalg.eigh(Z.T @ Z)
        some = g > LEAST_SHARED
        return Z @ V[:, some], g[some]

    @property
    def half_log_det(self) -> float:
        """Of K."""
        own = np.log(self.deviation).sum() + 0.5 * np.log1p(self.shared[1]).sum()
        return float(self.basis.half_log_det + own)

    def whiten(self, columns: Float[np.ndarray, "rows *some"]) -> Float[np.ndarray, "rows *some"]:
        """K^-½ columns."""
        U, g = self.shared
        return self._without((1.0 - (1.0 + g) ** -0.5) / g, self._scaled(columns, ALL), U)

    def seen(self, columns: Float[np.ndarray, "own some"], span: slice) -> Seen:
        """D^-½ columns, and diag(1 + g)^-½ Uᵀ D^-½ columns."""
        U, g = self.shared
        scaled = self._scaled(columns, span)
        return Seen(span, scaled, (U[span].T @ scaled) / np.sqrt(1.0 + g)[:, None])

    def times_precision(
        self, columns: Float[np.ndarray, "own *some"], span: slice = ALL
    ) -> Float[np.ndarray, "own *some"]:
        """K⁻¹ columns, of columns on the rows of some trials, on these rows."""
        U, g = self.shared
        return self._scaled(self._without(1.0 / (1.0 + g), self._scaled(columns, span), U[span]), span)

    def _scaled(self, columns: Float[np.ndarray, "own *some"], span: slice) -> Float[np.ndarray, "own *some"]:
        return (columns.T / self.deviation[span]).T

    @staticmethod
    def _without(
        shares: Float[np.ndarray, " directions"],
        columns: Float[np.ndarray, "own *some"],
        U: Float[np.ndarray, "own directions"],
    ) -> Float[np.ndarray, "own *some"]:
        """Columns less these shares of what they have along the shared directions."""
        return np.asarray(columns - U @ (shares * (columns.T @ U)).T)

    def _precision_at(self, span: slice) -> Float[np.ndarray, "own own"]:
        own, X = self.basis.of_trial(span)
        U, g = self.shared
        half = X / self.deviation[own]
        along = (half @ U[own]) / np.sqrt(1.0 + g)
        P = dsyrk(-1.0, along, beta=1.0, c=dsyrk(1.0, half), overwrite_c=True)
        return np.asarray(np.triu(P) + np.triu(P, 1).T)
