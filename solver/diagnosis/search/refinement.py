"""The best η of a candidate, searched with everything else fitted anew at every step.

Gauss–Newton: the rows' derivatives by η are further columns, and the fit with them tells how far η should go;
a step is halved until the fit there is better. Where that leads nowhere though the derivatives promise
something, the rows are not smooth enough, and a simplex goes on.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

from solver.diagnosis.causes.effect import Candidate, Eta, Fitted
from solver.diagnosis.noise.noise_scales import NoiseScale
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.screening import Beside, Gained, beside
from solver.diagnosis.search.terms import CandidateRows, Term

SMALL_STEP = 0.1  # of the first step, for derivatives by η
AGAIN_STEPS = 0.3  # of the first step, where a simplex starts from what another search found
CONVERGED = 0.05  # in steps and nats: the rest is left to the derivatives
LONGEST = 4.0  # first steps at a time
MOST_TURNS = 12
HALVINGS = 4


def refine(balance: Balance, term: Term, others: Sequence[Term], noise_scale: NoiseScale) -> Term:
    """The term at its best η, with derivatives by η as further columns; unchanged where all acts linearly.

    A term that was refined already, at another noise scale, is sought near its η.
    """
    candidate = term.candidate
    if not candidate.steps():
        return term
    climb = Climb(balance, candidate, beside(others, noise_scale))
    start = climb.at(term.eta)
    if start is None:
        return term
    best = climb.best(start, AGAIN_STEPS if term.tangent_mean else 1.0)
    return balance.spread(climb.with_tangents(best))


@dataclass(frozen=True, eq=False)
class Tried:
    """A candidate at one η beside the others."""

    rows: CandidateRows
    gained: Gained
    cost: float  # less is better [nats]


class Climb:
    """One candidate's η, beside accepted causes."""

    def __init__(self, balance: Balance, candidate: Candidate, others: Beside) -> None:
        self._balance, self._candidate, self._others = balance, candidate, others
        self._steps = np.array(candidate.steps())
        self._mean, self._std = np.array(candidate.prior(balance.scenes)).T
        self._tried: dict[Eta, Tried | None] = {}
        self._linear: dict[Eta, CandidateRows] = {}

    def at(self, eta: Eta) -> Tried | None:
        """At one η; None where there is no such cause."""
        if eta not in self._tried:
            candidate = self._candidate
            rows = self._balance.rows_of(candidate, eta) if candidate.admissible(eta) else None
            self._tried[eta] = None if rows is None else self._fit(rows)
        return self._tried[eta]

    def best(self, start: Tried, reach: float) -> Tried:
        """Where there is nothing better near.

        Args:
            start: where it begins; where that is possible, all else has to be.
            reach: of a simplex, in first steps.
        """
        here, must_be_possible = start, self._is_possible(start)
        for _ in range(MOST_TURNS):
            step, promised = self._step(here)
            far = np.abs(step / self._steps).max()
            if far < CONVERGED or (promised < CONVERGED and far < 1.0):
                return here
            step /= max(1.0, far / LONGEST)
            eta = np.array(here.rows.eta)
            halved = (self.at(tuple((eta + step / 2**k).tolist())) for k in range(HALVINGS))
            better = (t for t in halved if t is not None and t.cost < here.cost)
            further = next((t for t in better if not must_be_possible or self._is_possible(t)), None)
            if further is None:
                return self._by_simplex(here, reach, must_be_possible)
            if here.cost - further.cost < CONVERGED:
                return further
            here = further
        return here

    def with_tangents(self, one: Tried) -> CandidateRows:
        """Rows and, as further columns, their derivatives by η at the fitted x; kept."""
        if one.rows.eta not in self._linear:
            self._linear[one.rows.eta] = self._linearize(one)
        return self._linear[one.rows.eta]

    def _fit(self, rows: CandidateRows) -> Tried:
        gained = self._others.gain(rows)
        away = (np.array(rows.eta) - self._mean) / self._std
        return Tried(rows, gained, 0.5 * float(away @ away) - gained.log_evidence)

    def _is_possible(self, one: Tried) -> bool:
        nothing = tuple(0.0 for _ in one.rows.eta)
        gained, scenes = one.gained, self._balance.scenes
        estimates = self._candidate.estimates(
            scenes, Fitted(one.rows.eta, nothing, gained.x, gained.covariance)
        )
        return self._candidate.is_possible(estimates)

    def _step(self, here: Tried) -> tuple[Float[np.ndarray, " etas"], float]:
        """How far the derivatives say that η should move, and what they promise of it [nats]."""
        gained, n = self._others.gain(self.with_tangents(here)), len(here.gained.x)
        S, u = gained.information, gained.x[n:] / self._std
        own = S[n:, n:] - S[n:, :n] @ cho_solve(cho_factor(S[:n, :n]), S[:n, n:]) if n else S
        away = u - (np.array(here.rows.eta) - self._mean) / self._std
        return away * self._std, 0.5 * float(away @ own @ away)

    def _by_simplex(self, start: Tried, reach: float, must_be_possible: bool) -> Tried:
        """Nelder and Mead's search, which asks for no derivatives."""
        eta, n = np.array(start.rows.eta), len(self._steps)

        def cost(z: np.ndarray) -> float:
            found = self.at(tuple((eta + self._steps * z).tolist()))
            if found is None or (must_be_possible and not self._is_possible(found)):
                return np.inf
            return found.cost

        simplex = np.concatenate([np.zeros((1, n)), reach * np.eye(n)])
        options = {"initial_simplex": simplex, "xatol": CONVERGED, "fatol": CONVERGED, "maxfev": 30 * n}
        found = minimize(cost, np.zeros(n), method="Nelder-Mead", options=options)
        return self.at(tuple((eta + self._steps * found.x).tolist())) or start

    def _linearize(self, one: Tried) -> CandidateRows:
        rows, x = one.rows, one.gained.x
        tangents = []
        for i, step in enumerate(SMALL_STEP * self._steps):
            ahead, behind = (self._near(rows, _shift(rows.eta, i, by)) for by in (step, -step))
            width = ahead.eta[i] - behind.eta[i]
            if width:
                tangents.append((_prediction(ahead, x) - _prediction(behind, x)) / width)
            else:
                tangents.append(np.zeros(len(rows.columns)))
        T = np.stack(tangents, axis=1)
        fixed = T @ (self._mean - np.array(rows.eta))
        return replace(
            rows,
            fixed=fixed if rows.fixed is None else fixed + rows.fixed,
            columns=np.concatenate([rows.columns, T], axis=1),
            prior_std=np.concatenate([rows.prior_std, self._std]),
            tangent_mean=tuple(self._mean.tolist()),
        )

    def _near(self, rows: CandidateRows, eta: Eta) -> CandidateRows:
        """Rows at an η nearby; those that are there already where it lies out of bounds."""
        if not self._candidate.admissible(eta):
            return rows
        there = self._balance.rows_of(self._candidate, eta)
        assert there is not None
        assert there.span == rows.span
        return there


def _shift(eta: Eta, i: int, by: float) -> Eta:
    return tuple(value + by if k == i else value for k, value in enumerate(eta))


def _prediction(rows: CandidateRows, x: Float[np.ndarray, " parameters"]) -> Float[np.ndarray, " own"]:
    product = rows.columns @ x
    return product if rows.fixed is None else product + rows.fixed
