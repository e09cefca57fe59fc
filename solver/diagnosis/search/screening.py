"""The whole catalogue against the balance: each candidate at the best of its starts beside accepted causes.

A candidate's rows don't depend on what else is accepted: they are made once, and so is their product with
the precision P = K⁻¹ of each noise scale. Accepted causes, integrated out, take W Wᵀ off that precision,
with as many columns as they have parameters (Woodbury). A candidate with columns B (unit prior) on the rows
of its trials adds ½ (bᵀ S⁻¹ b − log det S) to the log evidence, with S = I + Bᵀ (P − W Wᵀ) B and
b = Bᵀ (P − W Wᵀ) r. Only the rows of its trials are touched. Candidates on the same trials with as many
parameters are stacked, and their small systems solved together.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from heapq import heapify, heappop, heappush

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import cho_factor, solve_triangular

from solver.diagnosis.causes.effect import Candidate, Fitted
from solver.diagnosis.noise.noise_scales import Basis, NoiseScale
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.contenders import handicap
from solver.diagnosis.search.terms import CandidateRows, Term, with_the_usual


@dataclass(frozen=True, eq=False)
class Screened:
    """A candidate at its best start."""

    rows: CandidateRows
    notable: bool  # its size there is one that anybody would act on
    possible: bool  # there can be such a cause
    gain: float  # log evidence beyond the accepted causes, at the same noise scale
    x: Float[np.ndarray, " parameters"]


@dataclass(frozen=True, eq=False)
class Gained:
    """What one candidate at one η adds to the accepted causes."""

    log_evidence: float
    x: Float[np.ndarray, " parameters"]
    information: Float[np.ndarray, "parameters parameters"]  # of x over its prior std
    prior_std: Float[np.ndarray, " parameters"]

    @property
    def covariance(self) -> Float[np.ndarray, "parameters parameters"]:
        """Of x."""
        return np.asarray(np.linalg.inv(self.information) * np.outer(self.prior_std, self.prior_std))


@dataclass(frozen=True, eq=False)
class Products:
    """Of candidates' columns C and fixed parts f with the precision of a noise scale, nothing accepted."""

    CPC: Float[np.ndarray, "candidates parameters parameters"]
    CPf: Float[np.ndarray, "candidates parameters"]
    fPf: Float[np.ndarray, " candidates"]


@dataclass(frozen=True, eq=False)
class Stack:
    """Candidates on the rows of the same trials, with as many parameters, all with a fixed part or none.

    Columns and fixed parts are those of the balance's basis.
    """

    span: slice
    columns: Float[np.ndarray, "candidates parameters own"]
    fixed: Float[np.ndarray, "candidates own"] | None
    prior_std: Float[np.ndarray, "candidates parameters"]

    @staticmethod
    def of(rows: Sequence[CandidateRows], basis: Basis) -> "Stack":
        """Of candidates that are alike."""
        span, width = rows[0].span, rows[0].columns.shape[1]
        columns = basis.transform(np.concatenate([r.columns for r in rows], axis=1), span)
        fixed = [r.fixed for r in rows if r.fixed is not None]
        return Stack(
            span,
            np.ascontiguousarray(columns.T).reshape(len(rows), width, len(columns)),
            np.ascontiguousarray(basis.transform(np.stack(fixed, axis=1), span).T) if fixed else None,
            np.stack([r.prior_std for r in rows]),
        )

    def times(
        self, weights: Float[np.ndarray, "own *some"]
    ) -> Float[np.ndarray, "candidates parameters *some"]:
        """Columnsᵀ weights."""
        many, width, own = self.columns.shape
        return (self.columns.reshape(many * width, own) @ weights).reshape(many, width, *weights.shape[1:])

    def products(self, noise_scale: NoiseScale) -> Products:
        """Only the rows of their trials are looked at."""
        many, width, own = self.columns.shape
        parts = self.columns
        if self.fixed is not None:
            parts = np.concatenate([parts, self.fixed[:, None]], axis=1)
        seen = noise_scale.seen(parts.reshape(-1, own).T, self.span)
        scaled, along = (np.reshape(part.T, (many, parts.shape[1], -1)) for part in (seen.scaled, seen.along))
        whole = scaled @ scaled.transpose(0, 2, 1) - along @ along.transpose(0, 2, 1)
        if self.fixed is None:
            return Products(whole, np.zeros(whole.shape[:2]), np.zeros(many))
        return Products(whole[:, :width, :width], whole[:, :width, width], whole[:, width, width])


def beside(accepted: Sequence[Term], noise_scale: NoiseScale) -> "Beside":
    """Kept: many candidates are tried beside the same causes."""
    return noise_scale.basis.kept.get(lambda: Beside(accepted, noise_scale), "beside", noise_scale, *accepted)


class Beside:
    """The residual's precision, accepted causes integrated out, at one noise scale: P − W Wᵀ, in the basis.

    Each further cause adds columns to W and leaves those of the causes before it, which are kept: many sets
    begin with the same causes.
    """

    def __init__(self, accepted: Sequence[Term], noise_scale: NoiseScale) -> None:
        self.noise_scale = noise_scale
        self._before: tuple[Beside, ...] = ()  # of fewer causes each, none first
        self._left = noise_scale.residual  # less what is fixed
        self.own: Float[np.ndarray, "rows own"] = np.zeros(
            (len(noise_scale.residual), 0)
        )  # columns of the last
        self.Pr: Float[np.ndarray, " rows"] = np.zeros(0)  # what accepted causes leave, weighted
        if not accepted:
            self.Pr = noise_scale.times_precision(noise_scale.residual)
            return
        before, term = beside(accepted[:-1], noise_scale), accepted[-1]
        self._before, self._left, self.Pr = before.each, before._left, before.Pr
        fixed, columns = term.within(noise_scale.basis)
        if fixed is not None:
            self._left = self._left - fixed
            self.Pr = self.Pr - before._without(noise_scale.times_precision(fixed), fixed)
        if columns.shape[1]:
            B = columns * term.prior_std
            PB = before._without(term.times_precision(noise_scale), B)
            M = B.T @ PB
            M[np.arange(len(M)), np.arange(len(M))] += 1.0
            factor = cho_factor(M, lower=True, check_finite=False)[0]
            self.own = solve_triangular(factor, PB.T, lower=True, check_finite=False).T
            self.Pr = self.Pr - self.own @ (self.own.T @ self._left)

    @property
    def each(self) -> tuple["Beside", ...]:
        """Those with fewer causes, and this one: all their columns together are W."""
        return (*self._before, self)

    def _without(
        self, weighted: Float[np.ndarray, "rows *some"], columns: Float[np.ndarray, "rows *some"]
    ) -> Float[np.ndarray, "rows *some"]:
        """(P − W Wᵀ) columns, of P columns."""
        for one in self.each:
            weighted = weighted - one.own @ (one.own.T @ columns)
        return weighted

    @property
    def nbytes(self) -> int:
        """That it takes, by rows as well."""
        return 2 * (self.own.nbytes + self.Pr.nbytes)

    @cached_property
    def _own_by_rows(self) -> Float[np.ndarray, "rows own"]:
        return self.noise_scale.basis.rows(self.own)

    @cached_property
    def left_by_rows(self) -> Float[np.ndarray, " rows"]:
        """What is left, weighted, of the balance's rows."""
        return self.noise_scale.basis.rows(self.Pr)

    def by_rows(self, some: slice | Int[np.ndarray, " some"]) -> Float[np.ndarray, "some accepted"]:
        """W of some of the balance's rows."""
        return np.concatenate([one._own_by_rows[some] for one in self.each], axis=1)

    def gain(self, rows: CandidateRows) -> Gained:
        """What a candidate adds.

        Args:
            rows: of one that is not among the accepted ones.
        """
        alone = Stack.of([rows], self.noise_scale.basis)
        across = np.concatenate([alone.times(one.own[alone.span]) for one in self.each], axis=2)
        return self.gains(alone, alone.products(self.noise_scale), across)[0]

    def across(self, stack: Stack) -> Float[np.ndarray, "candidates parameters accepted"]:
        """Columnsᵀ W of a stack that will be asked for again; kept for each accepted cause."""
        return np.concatenate([one._own_across(stack) for one in self.each], axis=2)

    def _own_across(self, stack: Stack) -> Float[np.ndarray, "candidates parameters own"]:
        kept = self.noise_scale.basis.kept
        return kept.get(lambda: stack.times(self.own[stack.span]), "across", stack, self)

    def gains(
        self, stack: Stack, products: Products, CW: Float[np.ndarray, "candidates parameters accepted"]
    ) -> list[Gained]:
        """Likewise of each of a stack.

        Args:
            stack: of candidates that are not among the accepted ones.
            products: of its rows at this noise scale.
            CW: its columnsᵀ W.
        """
        Pr, std = self.Pr[stack.span], stack.prior_std
        CPr, gain = stack.times(Pr), np.zeros(len(std))
        if stack.fixed is not None:
            fW = np.concatenate([stack.fixed @ one.own[stack.span] for one in self.each], axis=1)
            gain = stack.fixed @ Pr - 0.5 * (products.fPf - _each_squared(fW, fW))
            CPr = CPr - products.CPf + (CW @ fW[:, :, None])[:, :, 0]
        S = (products.CPC - CW @ CW.transpose(0, 2, 1)) * (std[:, :, None] * std[:, None, :])
        own = np.arange(S.shape[1])
        S[:, own, own] += 1.0
        b = CPr * std
        u = np.linalg.solve(S, b[:, :, None])[:, :, 0]
        gain = gain + 0.5 * _each_squared(b, u)
        gain -= np.log(np.linalg.cholesky(S)[:, own, own]).sum(axis=1)  # ½ log det S
        return [Gained(float(g), x, s, p) for g, x, s, p in zip(gain, u * std, S, std, strict=True)]


class Screen:
    """Rows of every candidate at every start."""

    def __init__(self, balance: Balance, candidates: Sequence[Candidate]) -> None:
        self._balance = balance
        self._rows: list[CandidateRows] = []
        self._starts: list[list[int]] = []  # of each candidate, places among all rows
        alike: dict[tuple[int, int, int, bool], list[int]] = {}
        for candidate in candidates:
            own = [balance.rows_of(candidate, eta) for eta in candidate.starts(balance.scenes)]
            self._starts.append([])
            for rows in own:
                if rows is not None:
                    kind = rows.span.start, rows.span.stop, rows.columns.shape[1], rows.fixed is None
                    alike.setdefault(kind, []).append(len(self._rows))
                    self._starts[-1].append(len(self._rows))
                    self._rows.append(rows)
        self._starts = [places for places in self._starts if places]
        self._stacks = [
            (places, Stack.of([self._rows[place] for place in places], balance.basis))
            for places in alike.values()
        ]
        self._products: dict[int, list[Products]] = {}  # by noise scale
        self._terms: dict[int, Term] = {}  # by rows, which are kept

    def best(self, noise_scale: NoiseScale, accepted: Sequence[Term] = ()) -> Iterator[Screened]:
        """Candidates that touch a trial, beside accepted causes, by what they gain over their odds.

        Of each candidate the start is taken that is notable, or at least possible, before those that gain
        more. What its starts gain bounds what it can: only candidates that may be the next are looked at.

        Args:
            noise_scale: scale of the model error.
            accepted: causes fitted with it; candidates among them are left out.
        """
        gained = self._find_gains(noise_scale, accepted)
        taken = {t.candidate.key for t in accepted}
        free = [places for places in self._starts if self._rows[places[0]].candidate.key not in taken]
        against = [handicap(self._rows[places[0]].candidate, self._balance.settings) for places in free]
        bounds = [a - max(gained[p].log_evidence for p in ps) for a, ps in zip(against, free, strict=True)]
        waiting: list[tuple[float, int, Screened | None]] = [
            (bound, k, None) for k, bound in enumerate(bounds)
        ]
        heapify(waiting)
        while waiting:
            _, k, known = heappop(waiting)
            if known is not None:
                yield known
                continue
            tried = [self._screen(self._rows[place], gained[place]) for place in free[k]]
            one = max(tried, key=lambda s: (s.notable, s.possible, s.gain))
            heappush(waiting, (against[k] - one.gain, k, one))

    def by_name(self, noise_scale: NoiseScale, accepted: Sequence[Term] = ()) -> Iterator[Screened]:
        """The best variant of each name, likeliest name first; of what cannot be, only what has a search."""
        named: set[tuple[str, str]] = set()
        for one in self.best(noise_scale, accepted):
            candidate = one.rows.candidate
            if candidate.key not in named and (one.possible or candidate.steps()):
                named.add(candidate.key)
                yield one

    def term(self, rows: CandidateRows) -> Term:
        """Rows of a candidate among those of all trials; always the same term, whose products are kept."""
        if id(rows) not in self._terms:
            self._terms[id(rows)] = self._balance.spread(rows)
        return self._terms[id(rows)]

    def _find_gains(self, noise_scale: NoiseScale, accepted: Sequence[Term]) -> list[Gained]:
        """At every start."""
        others = beside(accepted, noise_scale)
        if id(noise_scale) not in self._products:
            self._products[id(noise_scale)] = [stack.products(noise_scale) for _, stack in self._stacks]
        found: dict[int, Gained] = {}
        for (places, stack), products in zip(self._stacks, self._products[id(noise_scale)], strict=True):
            found.update(zip(places, others.gains(stack, products, others.across(stack)), strict=True))
        return [found[place] for place in range(len(self._rows))]

    def _screen(self, rows: CandidateRows, gained: Gained) -> Screened:
        candidate, nothing = rows.candidate, tuple(0.0 for _ in rows.eta)
        whole = with_the_usual(gained.x, gained.covariance, rows.prior_std, rows.usual_std)
        estimates = candidate.estimates(self._balance.scenes, Fitted(rows.eta, nothing, *whole))
        notable, possible = candidate.is_notable(estimates), candidate.is_possible(estimates)
        return Screened(rows, notable, possible, gained.log_evidence, gained.x)


def _each_squared(
    one: Float[np.ndarray, "candidates some"], other: Float[np.ndarray, "candidates some"]
) -> Float[np.ndarray, " candidates"]:
    """Inner products, row by row."""
    return np.asarray(np.einsum("ij,ij->i", one, other))
