"""The whole catalogue against the balance: each candidate at the best of its starts beside accepted causes.

A candidate's rows don't depend on what else is accepted: they are made once. Beside accepted causes, all of
them integrated out, the residual has the precision P; a candidate with columns B (unit prior) on the rows of
its trials adds ½ (bᵀ S⁻¹ b − log det S) to the log evidence, with S = I + Bᵀ P B and b = Bᵀ P r. Only those
rows of P are touched.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.linalg import cho_factor, cho_solve

from solver.diagnosis.balance import Balance, CandidateRows, Rung, Term
from solver.effects.effect import Candidate


@dataclass(frozen=True, eq=False)
class Screened:
    """A candidate at its best start."""

    rows: CandidateRows
    notable: bool  # its size there is one that anybody would act on
    possible: bool  # there can be such a cause
    gain: float  # log evidence beyond the accepted causes, at the same rung
    x: Float[np.ndarray, " parameters"]


class Screen:
    """Rows of every candidate at every start."""

    def __init__(self, balance: Balance, candidates: Sequence[Candidate]) -> None:
        self._balance = balance
        self._starts = [starts for c in candidates if (starts := _rows_of_starts(balance, c))]

    def at(self, rung: Rung, accepted: Sequence[Term] = ()) -> list[Screened]:
        """Every candidate that touches a trial, beside accepted causes, greatest gain first.

        Args:
            rung: scale of the model error.
            accepted: causes fitted with it; candidates among them are left out.
        """
        taken = {t.candidate.key for t in accepted}
        beside = Beside(accepted, rung)
        found = []
        for starts in self._starts:
            if starts[0].candidate.key not in taken:
                tried = [self._tried(beside, rows) for rows in starts]
                found.append(max(tried, key=lambda s: (s.notable, s.possible, s.gain)))
        return sorted(found, key=lambda s: -s.gain)

    def _tried(self, beside: "Beside", rows: CandidateRows) -> Screened:
        gain, x, covariance = beside.gain(rows)
        nothing = tuple(0.0 for _ in rows.eta)
        estimates = rows.candidate.estimates(self._balance.scenes, rows.eta, nothing, x, covariance)
        candidate = rows.candidate
        return Screened(rows, candidate.is_notable(estimates), candidate.is_possible(estimates), gain, x)


class Beside:
    """Precision of the residual with accepted causes integrated out, at one rung."""

    def __init__(self, accepted: Sequence[Term], rung: Rung) -> None:
        P, r = rung.precision, rung.residual
        for term in accepted:
            if term.fixed is not None:
                r = r - term.fixed
        parts = [t.columns * t.prior_std for t in accepted if t.columns.shape[1]]
        if parts:
            B = np.concatenate(parts, axis=1)
            PB = P @ B
            M = B.T @ PB
            M[np.arange(len(M)), np.arange(len(M))] += 1.0
            P = P - PB @ cho_solve(cho_factor(M, lower=True, check_finite=False), PB.T, check_finite=False)
        self._P, self._Pr = P, P @ r
        self._last: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None

    def gain(self, rows: CandidateRows) -> tuple[float, np.ndarray, np.ndarray]:
        """Log evidence that a candidate adds, its parameters and their covariance.

        Args:
            rows: of a candidate that is not among the accepted ones.
        """
        own = rows.span
        BPB, BPr = self._products(rows)
        gain = 0.0
        if rows.fixed is not None:
            Pf = self._P[own, own] @ rows.fixed
            gain = float(rows.fixed @ self._Pr[own] - 0.5 * rows.fixed @ Pf)
            BPr = BPr - rows.columns.T @ Pf
        S = BPB * np.outer(rows.prior_std, rows.prior_std)
        S[np.arange(len(S)), np.arange(len(S))] += 1.0
        factor = cho_factor(S, lower=True, check_finite=False)
        b = BPr * rows.prior_std
        u = cho_solve(factor, b, check_finite=False)
        gain += 0.5 * float(b @ u) - float(np.log(np.diag(factor[0])).sum())
        inverse = cho_solve(factor, np.eye(len(S)), check_finite=False)
        return gain, u * rows.prior_std, inverse * np.outer(rows.prior_std, rows.prior_std)

    def _products(
        self, rows: CandidateRows
    ) -> tuple[Float[np.ndarray, "parameters parameters"], Float[np.ndarray, " parameters"]]:
        """Columnsᵀ P columns and columnsᵀ P r; starts that share their columns come one after another."""
        if self._last is None or self._last[0] is not rows.columns:
            C = rows.columns
            self._last = C, C.T @ (self._P[rows.span, rows.span] @ C), C.T @ self._Pr[rows.span]
        return self._last[1], self._last[2]


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
