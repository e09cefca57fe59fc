"""Causes as rows of the balance: one at a time as terms, and several fitted together."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Float
from scipy.linalg import solve_triangular

from solver.diagnosis.causes.effect import Candidate, Estimate, Eta, Fitted
from solver.diagnosis.causes.observed_trial import Scene
from solver.diagnosis.noise.noise_scales import Basis, NoiseScale, Seen


@dataclass(frozen=True, eq=False)
class CandidateRows:
    """A candidate at one η, on the rows of the trials that it touches. Prior of x: N(0, prior_std²)."""

    candidate: Candidate
    eta: Eta
    span: slice
    fixed: Float[np.ndarray, " own"] | None
    columns: Float[np.ndarray, "own parameters"]
    prior_std: Float[np.ndarray, " parameters"]
    usual_std: float = 0.0  # what of x every laboratory has, within the balance's covariance
    tangent_mean: Eta = ()  # of η before the data, where the last columns are the derivatives by it


@dataclass(eq=False)
class Term:
    """A candidate at one η: its rows in all trials together. Prior of x: N(0, prior_std²).

    Once the best η is found, the last `len(tangent_mean)` columns are the derivatives by η, and their
    parameters its deviation from the prior's mean: then a step of η is part of every fit, of held-out blocks
    as well.
    """

    candidate: Candidate
    eta: Eta
    fixed: Float[np.ndarray, " rows"] | None
    columns: Float[np.ndarray, "rows parameters"]
    prior_std: Float[np.ndarray, " parameters"]
    tangent_mean: Eta = ()
    usual_std: float = 0.0
    span: slice | None = None  # rows of the trials that it touches, all others being zero; None: all touched
    same: object = field(default_factory=object)  # stands for the rows: terms of another prior share it

    @cached_property
    def rows(self) -> slice:
        """Of the trials that it touches."""
        return slice(0, len(self.columns)) if self.span is None else self.span

    def own(self, basis: Basis) -> Float[np.ndarray, "own parameters+"]:
        """Its rows in a basis: columns, and the fixed part after them where there is one; kept."""
        parts = [self.columns[self.rows]]
        if self.fixed is not None:
            parts.append(self.fixed[self.rows, None])
        return basis.kept.get(
            lambda: basis.transform(np.concatenate(parts, axis=1), self.rows), "own rows", self.same
        )

    def within(self, basis: Basis) -> tuple[np.ndarray | None, np.ndarray]:
        """Fixed part and columns in a basis, on all rows."""
        whole = np.zeros((len(self.columns), self.columns.shape[1] + (self.fixed is not None)))
        whole[self.rows] = self.own(basis)
        return (None if self.fixed is None else whole[:, -1]), whole[:, : self.columns.shape[1]]

    def whiten(self, noise_scale: NoiseScale) -> tuple[np.ndarray | None, np.ndarray]:
        """Fixed part and columns, at one noise scale."""
        fixed, columns = self.within(noise_scale.basis)
        return (
            None if fixed is None else noise_scale.whiten(fixed),
            noise_scale.whiten(columns) if columns.shape[1] else columns,
        )

    def seen(self, noise_scale: NoiseScale) -> Seen:
        """Its own rows, as products at one noise scale need them; kept."""
        return noise_scale.basis.kept.get(
            lambda: noise_scale.seen(self.own(noise_scale.basis), self.rows), "seen", self.same, noise_scale
        )

    def times_precision(self, noise_scale: NoiseScale) -> Float[np.ndarray, "rows parameters"]:
        """K⁻¹ columns at a noise scale, on all rows, each parameter at one prior standard deviation; kept."""
        return self.prior_std * noise_scale.basis.kept.get(
            lambda: noise_scale.times_precision(self.within(noise_scale.basis)[1]),
            "weighted",
            self.same,
            noise_scale,
        )

    def on_residual(self, noise_scale: NoiseScale) -> Float[np.ndarray, " parameters+"]:
        """Rowsᵀ K⁻¹ residual, the fixed part last where there is one; kept."""
        return noise_scale.basis.kept.get(
            lambda: self.seen(noise_scale).times(noise_scale.seen_residual)[:, 0],
            "on residual",
            self.same,
            noise_scale,
        )

    def product(self, other: "Term", noise_scale: NoiseScale) -> Float[np.ndarray, "parameters+ others+"]:
        """Rowsᵀ K⁻¹ rows of another term, or of itself, fixed parts last where there are some; kept."""
        return noise_scale.basis.kept.get(
            lambda: self.seen(noise_scale).times(other.seen(noise_scale)),
            "product",
            self.same,
            other.same,
            noise_scale,
        )


@dataclass(frozen=True, eq=False)
class Solved:
    """Terms fitted together at one noise scale."""

    terms: tuple[Term, ...]
    noise_scale: NoiseScale
    log_evidence: float
    x: Float[np.ndarray, " parameters"]
    std: Float[np.ndarray, " parameters"]  # of x before the data
    root: Float[np.ndarray, "parameters parameters"]  # lower; root rootᵀ is the precision of x / std
    _estimates: dict[int, dict[str, Estimate]] = field(
        default_factory=dict, init=False
    )  # a copy makes its own
    _covariances: dict[int, Float[np.ndarray, "own own"]] = field(default_factory=dict, init=False)

    @cached_property
    def left(self) -> Float[np.ndarray, " rows"]:
        """Whitened rest."""
        return self.noise_scale.whiten(self.noise_scale.residual - self.all_taken())

    def left_of(self, residual: Float[np.ndarray, " rows"]) -> Float[np.ndarray, " rows"]:
        """The rest of a balance's residual, as it is."""
        for k, term in enumerate(self.terms):
            residual = residual - term.columns @ self.x[self._own(k)]
            if term.fixed is not None:
                residual = residual - term.fixed
        return residual

    def estimates(self, k: int, scenes: Sequence[Scene]) -> dict[str, Estimate]:
        """The catalogue's parameters of the k-th term, with what every laboratory has of them."""
        if k not in self._estimates:
            self._estimates[k] = self._estimate(k, scenes)
        return dict(self._estimates[k])

    def _estimate(self, k: int, scenes: Sequence[Scene]) -> dict[str, Estimate]:
        term = self.terms[k]
        x, covariance = self.of(k)
        eta, eta_std = self.eta(k)
        linear = len(x) - len(term.tangent_mean)
        x, covariance = with_the_usual(
            x[:linear], covariance[:linear, :linear], term.prior_std[:linear], term.usual_std
        )
        return term.candidate.estimates(scenes, Fitted(eta, eta_std, x, covariance))

    def eta(self, k: int) -> tuple[Eta, Eta]:
        """Value and standard deviation of each η of the k-th term."""
        term = self.terms[k]
        x, covariance = self.of(k)
        if not term.tangent_mean:
            return term.eta, tuple(0.0 for _ in term.eta)
        linear = len(x) - len(term.tangent_mean)
        value = tuple(float(m + d) for m, d in zip(term.tangent_mean, x[linear:], strict=True))
        return value, tuple(np.sqrt(np.diag(covariance)[linear:]).tolist())

    def of(self, k: int) -> tuple[Float[np.ndarray, " own"], Float[np.ndarray, "own own"]]:
        """Parameters of the k-th term and their covariance."""
        own = self._own(k)
        if k not in self._covariances:
            below = self.root[own.start :, own.start :]  # what is above of its inverse's columns is zero
            unit = np.eye(len(below), own.stop - own.start)
            inverse = solve_triangular(below, unit, lower=True, check_finite=False) * self.std[own]
            self._covariances[k] = inverse.T @ inverse
        return self.x[own], self._covariances[k]

    def _own(self, k: int) -> slice:
        """Of the k-th term among all parameters."""
        start = sum(t.columns.shape[1] for t in self.terms[:k])
        return slice(start, start + self.terms[k].columns.shape[1])

    def explained(self, k: int, noise_scale: NoiseScale) -> Float[np.ndarray, " rows"]:
        """What the k-th term takes off the residual, whitened at a noise scale."""
        whole = np.zeros(len(noise_scale.residual))
        whole[self.terms[k].rows] = self._taken(k)
        return noise_scale.whiten(whole)

    def all_taken(self) -> Float[np.ndarray, " rows"]:
        """What all terms take off the residual, in the basis."""
        whole = np.zeros(len(self.noise_scale.residual))
        for k, term in enumerate(self.terms):
            whole[term.rows] += self._taken(k)
        return whole

    def _taken(self, k: int) -> Float[np.ndarray, " own"]:
        """What the k-th term takes off the residual, on its own rows in the basis."""
        term, x = self.terms[k], self.x[self._own(k)]
        sizes = x if term.fixed is None else np.append(x, 1.0)
        return np.asarray(term.own(self.noise_scale.basis) @ sizes)


def with_the_usual(
    x: Float[np.ndarray, " own"],
    covariance: Float[np.ndarray, "own own"],
    prior_std: Float[np.ndarray, " own"],
    usual_std: float,
) -> tuple[Float[np.ndarray, " own"], Float[np.ndarray, "own own"]]:
    """Mean and covariance of x + z: what every laboratory has, z, acts through the same columns as x.

    With x ~ N(0, p²) and z ~ N(0, u²), x given their sum s is s p² / (p² + u²) with variance
    p² u² / (p² + u²); solved for s.
    """
    p2, u2 = prior_std**2, usual_std**2
    share = p2 / (p2 + u2)
    within = covariance - np.diag(p2 * u2 / (p2 + u2))
    own = np.arange(len(within))
    within[own, own] = np.maximum(within[own, own], 0.0)  # rounding, where the sum is known exactly
    return x / share, within / np.outer(share, share)


def normal_equations(
    terms: Sequence[Term], noise_scale: NoiseScale
) -> tuple[Float[np.ndarray, "parameters parameters"], Float[np.ndarray, " parameters"], float]:
    """Columnsᵀ K⁻¹ columns (the lower triangle), columnsᵀ K⁻¹ y, yᵀ K⁻¹ y: y is without what is fixed."""
    ends = np.cumsum([0, *(len(t.prior_std) for t in terms)])
    M, b, square = np.zeros((ends[-1], ends[-1])), np.zeros(ends[-1]), noise_scale.square
    for k, term in enumerate(terms):
        own, n = slice(ends[k], ends[k + 1]), len(term.prior_std)
        on_residual = term.on_residual(noise_scale)
        b[own] += on_residual[:n]
        if term.fixed is not None:
            square -= 2.0 * float(on_residual[n])
        for i, other in enumerate(terms[: k + 1]):
            product, m = term.product(other, noise_scale), len(other.prior_std)
            M[own, ends[i] : ends[i + 1]] = product[:n, :m]
            if other.fixed is not None:
                b[own] -= product[:n, m]
            if term.fixed is not None and other is not term:
                b[ends[i] : ends[i + 1]] -= product[n, :m]
            if term.fixed is not None and other.fixed is not None:
                square += (1.0 if other is term else 2.0) * float(product[n, m])
    return M, b, square
