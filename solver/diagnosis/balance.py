"""The wrench balance of all trials as one Gaussian, and how likely it is with and without a cause.

r = demanded − measured, averaged over short windows, moments about the centre of mass. Its covariance
K(s, h) = markers' errors carried through the motion + plates' noise + inertias within what anthropometry
scatters (shared by trials) + plates that are a little off + h² flesh that slides with the joints + s² model
errors that last a tenth of a second. Candidates enter as columns with a Gaussian prior; all that the ordinary
fit can absorb is thereby projected out within its own prior. Every hypothesis, no cause included, has the
scales s and h that suit it best and pays for them through the determinant of K: none can win by shrinking the
noise. How far flesh slides differs between persons, and a recording of some seconds tells it.
"""

from collections.abc import Collection, Sequence
from copy import copy
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import cho_solve, cholesky, solve_triangular

from solver.diagnosis.covariances import Basis, Covariances, Rung, Seen, TrialsBasis
from solver.diagnosis.laboratory import laboratory_errors, usual_std
from solver.diagnosis.ladder import Ladder
from solver.diagnosis.rows import TrialRows
from solver.diagnosis.witnesses.weighings import Weighings
from solver.diagnosis_settings import DiagnosisSettings
from solver.effects.effect import Candidate, Estimate, Eta
from solver.effects.scene import Scene

MANY_ROWS = 1200  # from which on turning them pays


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
    parameters its deviation from the prior's mean: then a step of η is part of every fit, of withheld blocks
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
            lambda: basis.turned(np.concatenate(parts, axis=1), self.rows), "own rows", self.same
        )

    def within(self, basis: Basis) -> tuple[np.ndarray | None, np.ndarray]:
        """Fixed part and columns in a basis, on all rows."""
        whole = np.zeros((len(self.columns), self.columns.shape[1] + (self.fixed is not None)))
        whole[self.rows] = self.own(basis)
        return (None if self.fixed is None else whole[:, -1]), whole[:, : self.columns.shape[1]]

    def whitened(self, rung: Rung) -> tuple[np.ndarray | None, np.ndarray]:
        """Fixed part and columns, at one rung."""
        fixed, columns = self.within(rung.basis)
        return (
            None if fixed is None else rung.whitened(fixed),
            rung.whitened(columns) if columns.shape[1] else columns,
        )

    def seen(self, rung: Rung) -> Seen:
        """Its own rows, as products at one rung need them; kept."""
        return rung.basis.kept.get(
            lambda: rung.seen(self.own(rung.basis), self.rows), "seen", self.same, rung
        )

    def weighted(self, rung: Rung) -> Float[np.ndarray, "rows parameters"]:
        """K⁻¹ columns at one rung, on all rows, each parameter at one prior standard deviation; kept."""
        return self.prior_std * rung.basis.kept.get(
            lambda: rung.weighted(self.within(rung.basis)[1]), "weighted", self.same, rung
        )

    def on_residual(self, rung: Rung) -> Float[np.ndarray, " parameters+"]:
        """Rowsᵀ K⁻¹ residual, the fixed part last where there is one; kept."""
        return rung.basis.kept.get(
            lambda: self.seen(rung).times(rung.seen_residual)[:, 0], "on residual", self.same, rung
        )

    def product(self, other: "Term", rung: Rung) -> Float[np.ndarray, "parameters+ others+"]:
        """Rowsᵀ K⁻¹ rows of another term, or of itself, fixed parts last where there are some; kept."""
        return rung.basis.kept.get(
            lambda: self.seen(rung).times(other.seen(rung)), "product", self.same, other.same, rung
        )


@dataclass(frozen=True, eq=False)
class Solved:
    """Terms fitted together at one rung."""

    terms: tuple[Term, ...]
    rung: Rung
    log_evidence: float
    x: Float[np.ndarray, " parameters"]
    std: Float[np.ndarray, " parameters"]  # of x before the data
    root: Float[np.ndarray, "parameters parameters"]  # lower; root rootᵀ is the precision of x / std
    _estimates: dict[int, dict[str, Estimate]] = field(
        default_factory=dict, init=False
    )  # a copy makes its own

    @cached_property
    def left(self) -> Float[np.ndarray, " rows"]:
        """Whitened rest."""
        rest = self.rung.residual.copy()
        for k, term in enumerate(self.terms):
            rest[term.rows] -= self._taken(k)
        return self.rung.whitened(rest)

    def left_of(self, residual: Float[np.ndarray, " rows"]) -> Float[np.ndarray, " rows"]:
        """The rest of a balance's residual, as it is."""
        for k, term in enumerate(self.terms):
            residual = residual - term.columns @ self.x[self._own(k)]
            if term.fixed is not None:
                residual = residual - term.fixed
        return residual

    @cached_property
    def covariance(self) -> Float[np.ndarray, "parameters parameters"]:
        """Of x."""
        inverse = solve_triangular(self.root, np.eye(len(self.root)), lower=True, check_finite=False)
        inverse *= self.std
        return inverse.T @ inverse

    def estimates(self, k: int, scenes: Sequence[Scene]) -> dict[str, Estimate]:
        """The catalogue's parameters of the k-th term, with what every laboratory has of them."""
        if k not in self._estimates:
            self._estimates[k] = self._estimated(k, scenes)
        return dict(self._estimates[k])

    def _estimated(self, k: int, scenes: Sequence[Scene]) -> dict[str, Estimate]:
        term = self.terms[k]
        x, covariance = self.of(k)
        eta, eta_std = self.eta(k)
        linear = len(x) - len(term.tangent_mean)
        x, covariance = with_the_usual(
            x[:linear],
            covariance[:linear, :linear],
            term.prior_std[:linear],
            term.usual_std,
        )
        return term.candidate.estimates(scenes, eta, eta_std, x, covariance)

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
        return self.x[own], self.covariance[own, own]

    def _own(self, k: int) -> slice:
        """Of the k-th term among all parameters."""
        start = sum(t.columns.shape[1] for t in self.terms[:k])
        return slice(start, start + self.terms[k].columns.shape[1])

    def explained(self, k: int, rung: Rung) -> Float[np.ndarray, " rows"]:
        """What the k-th term takes off the residual, whitened at a rung."""
        whole = np.zeros(len(rung.residual))
        whole[self.terms[k].rows] = self._taken(k)
        return rung.whitened(whole)

    def _taken(self, k: int) -> Float[np.ndarray, " own"]:
        """What the k-th term takes off the residual, on its own rows in the basis."""
        term, x = self.terms[k], self.x[self._own(k)]
        sizes = x if term.fixed is None else np.append(x, 1.0)
        return np.asarray(term.own(self.rung.basis) @ sizes)


class Balance:
    """All trials' rows and the ladder of scales."""

    def __init__(self, trials: Sequence[TrialRows], settings: DiagnosisSettings) -> None:
        self.trials, self.settings = tuple(trials), settings
        self._scenes = tuple(t.scene for t in trials)
        self.start: Int[np.ndarray, " trials+1"] = np.concatenate(
            [[0], np.cumsum([len(t.residual) for t in trials])]
        )
        self.residual = np.concatenate([t.residual for t in trials])
        self.mass = np.concatenate([t.mass for t in trials])
        nuisance = np.concatenate([t.nuisance for t in trials])
        of = Covariances(
            self.residual,
            fixed=tuple(t.covariance for t in trials),
            model=tuple(t.model_error for t in trials),
            shared=np.concatenate([nuisance, laboratory_errors(trials, settings)], axis=1),
            tissue=np.concatenate([t.tissue for t in trials]),
        )
        self.basis = TrialsBasis(of) if len(self.residual) > MANY_ROWS else Basis(of)
        self.ladder = Ladder(self.basis, settings)
        self.rungs = self.ladder.rungs
        self.accused: frozenset[str] = frozenset()
        self.weighings = Weighings()
        self.evaluations = 0.0  # rows fitted so far

    @property
    def is_exhausted(self) -> bool:
        """Whether a search has had as many evaluations as it may have."""
        return self.evaluations >= self.settings.most_evaluations

    def witnessed(self, accused: Collection[str], weighings: Weighings) -> "Balance":
        """The same, with what witnesses say of it.

        Args:
            accused: plates that are grossly wrong: nothing else is named beside that.
            weighings: of the person on each plate, which refute other units.
        """
        other = copy(self)
        other.accused, other.weighings = frozenset(accused), weighings
        return other

    @property
    def scenes(self) -> tuple[Scene, ...]:
        """Of the trials."""
        return self._scenes

    def rows_of(self, candidate: Candidate, eta: Eta) -> CandidateRows | None:
        """A candidate's rows at η, of the trials that it touches; None where it touches none."""
        parts = [candidate.signature(t.scene, eta) for t in self.trials]
        touched = [k for k, p in enumerate(parts) if p is not None]
        if not touched:
            return None
        span = slice(int(self.start[touched[0]]), int(self.start[touched[-1] + 1]))
        some = [parts[k] for k in touched]
        prior = next(p.prior_std for p in reversed(some) if p is not None)
        columns = np.zeros((span.stop - span.start, len(prior)))
        has_fixed = any(p is not None and p.fixed is not None for p in some)
        fixed = np.zeros(len(columns)) if has_fixed else None
        for k in touched:
            part, t = parts[k], self.trials[k]
            assert part is not None
            own = slice(int(self.start[k]) - span.start, int(self.start[k + 1]) - span.start)
            if len(prior):
                columns[own] = t.reduced(part.columns)
            if fixed is not None and part.fixed is not None:
                fixed[own] = t.reduced(part.fixed)
        usual = usual_std(candidate, self.settings)
        return CandidateRows(candidate, eta, span, fixed, columns, prior, usual)

    def term(self, candidate: Candidate, eta: Eta) -> Term | None:
        """A candidate's rows at η among those of all trials; None where it touches no trial."""
        rows = self.rows_of(candidate, eta)
        return None if rows is None else self.spread(rows)

    def spread(self, rows: CandidateRows) -> Term:
        """Rows of some trials among those of all."""
        columns = np.zeros((len(self.residual), rows.columns.shape[1]))
        columns[rows.span] = rows.columns
        fixed = None
        if rows.fixed is not None:
            fixed = np.zeros(len(self.residual))
            fixed[rows.span] = rows.fixed
        return Term(
            rows.candidate,
            rows.eta,
            fixed,
            columns,
            rows.prior_std,
            rows.tangent_mean,
            rows.usual_std,
            rows.span,
        )

    def see_ahead(self, terms: Sequence[Term], beside: Sequence[Term], near: Rung) -> None:
        """Many terms at once, with their products with others, at a rung and where climbs from it look first.

        Args:
            terms: that will be fitted one by one.
            beside: the same terms, before each of them.
            near: where the climbs begin.
        """
        for rung in self.ladder.around(near):
            alike: dict[tuple[int, int], list[Term]] = {}
            for term in terms:
                if not self.basis.kept.has("seen", term.same, rung):
                    alike.setdefault((term.rows.start, term.rows.stop), []).append(term)
            for some in alike.values():
                self._see_together(some, beside, rung)

    def _see_together(self, terms: Sequence[Term], beside: Sequence[Term], rung: Rung) -> None:
        """Terms on the same rows."""
        kept, parts = self.basis.kept, [term.own(self.basis) for term in terms]
        whole = rung.seen(np.concatenate(parts, axis=1), terms[0].rows)
        products = [whole.times(other.seen(rung)) for other in beside]
        ends = np.cumsum([part.shape[1] for part in parts])
        for term, part, end in zip(terms, parts, ends, strict=True):
            own = slice(end - part.shape[1], end)
            seen = Seen(whole.rows, whole.scaled[:, own].copy(), whole.along[:, own].copy())
            kept.put(seen, "seen", term.same, rung)
            for other, product in zip(beside, products, strict=True):
                kept.put(product[own].copy(), "product", term.same, other.same, rung)

    def mass_strain(self, solved: Solved) -> float:
        """How far a hypothesis needs the body's mass from the entered one, in prior standard deviations.

        The posterior mean of a nuisance z ~ N(0, 1) with rows h is hᵀ K⁻¹ (what terms leave).
        """
        return float(solved.rung.whitened(self.basis.turned(self.mass)) @ solved.left)

    def solve_at(self, terms: Sequence[Term], rung: Rung) -> Solved:
        """Terms fitted together at one scale."""
        self.evaluations += len(self.residual)
        std = np.concatenate([t.prior_std for t in terms]) if terms else np.zeros(0)
        M, b, square = _normal_equations(terms, rung)
        if not len(std):
            return Solved(tuple(terms), rung, rung.constant - 0.5 * square, std, std, np.zeros((0, 0)))
        L = self._root(terms, rung, M, std)
        b *= std
        u = cho_solve((L, True), b, check_finite=False)
        log = rung.constant - 0.5 * float(square - b @ u) - float(np.log(np.diag(L)).sum())
        return Solved(tuple(terms), rung, log, u * std, std, L)

    def _root(
        self,
        terms: Sequence[Term],
        rung: Rung,
        M: Float[np.ndarray, "parameters parameters"],
        std: Float[np.ndarray, " parameters"],
    ) -> Float[np.ndarray, "parameters parameters"]:
        """Lower root of I + M at one standard deviation each; that of all terms but the last is kept.

        Many are fitted beside the same others: only what the last adds is factored anew.
        """
        n = len(std) - len(terms[-1].prior_std)

        def of(own: slice, others: slice) -> Float[np.ndarray, "some others"]:
            return np.asarray(M[own, others] * np.outer(std[own], std[others]))

        def factored(own: slice, less: Float[np.ndarray, "own own"] | float = 0.0) -> np.ndarray:
            S = of(own, own) - less
            S[np.arange(len(S)), np.arange(len(S))] += 1.0
            return np.asarray(cholesky(S, lower=True, overwrite_a=True, check_finite=False))

        before, last = slice(0, n), slice(n, None)
        if not n:
            return factored(last)
        first = rung.basis.kept.get(lambda: factored(before), "root", rung, *terms[:-1])
        across = solve_triangular(first, of(last, before).T, lower=True, check_finite=False)
        L = np.zeros((len(std), len(std)))
        L[before, before], L[last, before] = first, across.T
        L[last, last] = factored(last, across.T @ across)
        return L

    def solve(self, terms: Sequence[Term], near: Rung | None = None) -> Solved:
        """Terms fitted together at the scales that suit them best.

        Args:
            terms: any number.
            near: where the climb over the ladder begins; None: at the usual slack.
        """
        return self.ladder.best(lambda rung: self.solve_at(terms, rung), near)


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


def _normal_equations(
    terms: Sequence[Term], rung: Rung
) -> tuple[Float[np.ndarray, "parameters parameters"], Float[np.ndarray, " parameters"], float]:
    """Columnsᵀ K⁻¹ columns (the lower triangle), columnsᵀ K⁻¹ y, yᵀ K⁻¹ y: y is without what is fixed."""
    ends = np.cumsum([0, *(len(t.prior_std) for t in terms)])
    M, b, square = np.zeros((ends[-1], ends[-1])), np.zeros(ends[-1]), rung.square
    for k, term in enumerate(terms):
        own, n = slice(ends[k], ends[k + 1]), len(term.prior_std)
        on_residual = term.on_residual(rung)
        b[own] += on_residual[:n]
        if term.fixed is not None:
            square -= 2.0 * float(on_residual[n])
        for i, other in enumerate(terms[: k + 1]):
            product, m = term.product(other, rung), len(other.prior_std)
            M[own, ends[i] : ends[i + 1]] = product[:n, :m]
            if other.fixed is not None:
                b[own] -= product[:n, m]
            if term.fixed is not None and other is not term:
                b[ends[i] : ends[i + 1]] -= product[n, :m]
            if term.fixed is not None and other.fixed is not None:
                square += (1.0 if other is term else 2.0) * float(product[n, m])
    return M, b, square
