"""The whole catalogue against the balance: each candidate at the best of its starts beside accepted causes.

A candidate's rows don't depend on what else is accepted: they are made once, and so is their product with
the precision P = K⁻¹ of each rung. Accepted causes, all of them integrated out, take W Wᵀ off that precision,
with as many columns as they have parameters (Woodbury). A candidate with columns B (unit prior) on the rows
of its trials adds ½ (bᵀ S⁻¹ b − log det S) to the log evidence, with S = I + Bᵀ (P − W Wᵀ) B and
b = Bᵀ (P − W Wᵀ) r. Only the rows of its trials are touched.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from solver.diagnosis.balance import Balance, CandidateRows, Term, with_the_usual
from solver.diagnosis.contenders import handicap
from solver.diagnosis.ladder import Rung
from solver.effects.effect import Candidate


@dataclass(frozen=True, eq=False)
class Screened:
    """A candidate at its best start."""

    rows: CandidateRows
    notable: bool  # its size there is one that anybody would act on
    possible: bool  # there can be such a cause
    gain: float  # log evidence beyond the accepted causes, at the same rung
    x: Float[np.ndarray, " parameters"]


@dataclass(frozen=True, eq=False)
class Products:
    """Of a candidate's columns C and fixed part f with the precision of a rung, nothing accepted."""

    CPC: Float[np.ndarray, "parameters parameters"]
    CPf: Float[np.ndarray, " parameters"]
    fPf: float


def products_of(rows: CandidateRows, rung: Rung) -> Products:
    """Only rows of the trials that the candidate touches are read."""
    return products_of_all([rows], rung)[0]


def products_of_all(all_rows: Sequence[CandidateRows], rung: Rung) -> list[Products]:
    """Of many candidates: the precision of the trials that some of them touch is read once."""
    found: dict[int, Products] = {}
    for span in {(r.span.start, r.span.stop): r.span for r in all_rows}.values():
        own = [r for r in all_rows if r.span == span]
        parts = [r.columns if r.fixed is None else np.column_stack([r.columns, r.fixed]) for r in own]
        ends = np.cumsum([part.shape[1] for part in parts])
        weighted = rung.precision[span, span] @ np.concatenate(parts, axis=1)
        for rows, part, Pparts in zip(own, parts, np.split(weighted, ends[:-1], axis=1), strict=True):
            n = rows.columns.shape[1]
            whole = part.T @ Pparts
            CPf, fPf = whole[:n, n:].sum(axis=1), whole[n:, n:].sum()  # of one column, or of none
            found[id(rows)] = Products(whole[:n, :n], CPf, float(fPf))
    return [found[id(r)] for r in all_rows]


class Beside:
    """The residual's precision with accepted causes integrated out, at one rung: P − W Wᵀ."""

    def __init__(self, accepted: Sequence[Term], rung: Rung) -> None:
        P, r = rung.precision, rung.residual
        for term in accepted:
            if term.fixed is not None:
                r = r - term.fixed
        self.rung = rung
        self.W: Float[np.ndarray, "rows accepted"] = np.zeros((len(r), 0))
        self.Pr: Float[np.ndarray, " rows"] = P @ r  # what accepted causes leave of the residual, weighted
        some = [t for t in accepted if t.columns.shape[1]]
        if some:
            B = np.concatenate([t.columns * t.prior_std for t in some], axis=1)
            PB = np.concatenate([t.weighted(rung) for t in some], axis=1)
            M = B.T @ PB
            M[np.arange(len(M)), np.arange(len(M))] += 1.0
            factor = cho_factor(M, lower=True, check_finite=False)[0]
            self.W = solve_triangular(factor, PB.T, lower=True, check_finite=False).T
            self.Pr = self.Pr - self.W @ (self.W.T @ r)

    def gain(
        self, rows: CandidateRows, products: Products
    ) -> tuple[float, Float[np.ndarray, " parameters"], Float[np.ndarray, "parameters parameters"]]:
        """Log evidence that a candidate adds, its parameters and their covariance.

        Args:
            rows: of a candidate that is not among the accepted ones.
            products: of these rows at this rung.
        """
        C, W, Pr = rows.columns, self.W[rows.span], self.Pr[rows.span]
        CW, CPr, gain = C.T @ W, C.T @ Pr, 0.0
        if rows.fixed is not None:
            fW = rows.fixed @ W
            gain = float(rows.fixed @ Pr - 0.5 * (products.fPf - fW @ fW))
            CPr = CPr - (products.CPf - CW @ fW)
        S = (products.CPC - CW @ CW.T) * np.outer(rows.prior_std, rows.prior_std)
        S[np.arange(len(S)), np.arange(len(S))] += 1.0
        factor = cho_factor(S, lower=True, check_finite=False)
        b = CPr * rows.prior_std
        u = cho_solve(factor, b, check_finite=False)
        gain += 0.5 * float(b @ u) - float(np.log(np.diag(factor[0])).sum())
        inverse = cho_solve(factor, np.eye(len(S)), check_finite=False)
        return gain, u * rows.prior_std, inverse * np.outer(rows.prior_std, rows.prior_std)


class Screen:
    """Rows of every candidate at every start."""

    def __init__(self, balance: Balance, candidates: Sequence[Candidate]) -> None:
        self._balance = balance
        self._starts = [starts for c in candidates if (starts := _rows_of_starts(balance, c))]
        self._products: dict[int, dict[int, Products]] = {}  # by rung, by place

    def at(self, rung: Rung, accepted: Sequence[Term] = ()) -> list[Screened]:
        """Every candidate that touches a trial, beside accepted causes, greatest gain first.

        Args:
            rung: scale of the model error.
            accepted: causes fitted with it; candidates among them are left out.
        """
        taken = {t.candidate.key for t in accepted}
        beside = Beside(accepted, rung)
        free = [starts for starts in self._starts if starts[0].candidate.key not in taken]
        products = self._products_at(rung, [rows for starts in free for rows in starts])
        found = []
        for starts in free:
            tried = [self._tried(beside, rows, products[_place(rows)]) for rows in starts]
            found.append(max(tried, key=lambda s: (s.notable, s.possible, s.gain)))
        return sorted(found, key=lambda s: -s.gain)

    def by_name(self, rung: Rung, accepted: Sequence[Term] = ()) -> list[Screened]:
        """The best variant of each name, likeliest name first; of what cannot be, only what has a search."""
        able = [s for s in self.at(rung, accepted) if s.possible or s.rows.candidate.steps()]
        able.sort(key=lambda s: handicap(s.rows.candidate, self._balance.settings) - s.gain)
        best: dict[tuple[str, str], Screened] = {}
        for one in able:
            best.setdefault(one.rows.candidate.key, one)
        return list(best.values())

    def _tried(self, beside: Beside, rows: CandidateRows, products: Products) -> Screened:
        gain, x, covariance = beside.gain(rows, products)
        nothing = tuple(0.0 for _ in rows.eta)
        whole = with_the_usual(x, covariance, rows.prior_std, rows.usual_std)
        estimates = rows.candidate.estimates(self._balance.scenes, rows.eta, nothing, *whole)
        candidate = rows.candidate
        return Screened(rows, candidate.is_notable(estimates), candidate.is_possible(estimates), gain, x)

    def _products_at(self, rung: Rung, wanted: Sequence[CandidateRows]) -> dict[int, Products]:
        """By place; those that are not known yet all at once."""
        known = self._products.setdefault(id(rung), {})
        fresh = {_place(rows): rows for rows in wanted if _place(rows) not in known}
        known.update(zip(fresh, products_of_all(list(fresh.values()), rung), strict=True))
        return known


def _place(rows: CandidateRows) -> int:
    """The same for rows whose products are equal: kept columns, no fixed part."""
    return id(rows.columns if rows.fixed is None else rows)


def _rows_of_starts(balance: Balance, candidate: Candidate) -> list[CandidateRows]:
    """At each start; equal columns, as where only the prior changes, are kept once."""
    found: list[CandidateRows] = []
    for eta in candidate.starts(balance.scenes):
        rows = balance.rows_of(candidate, eta)
        if rows is None:
            continue
        if found and np.array_equal(found[-1].columns, rows.columns):
            rows = replace(rows, columns=found[-1].columns)
        found.append(rows)
    return found
