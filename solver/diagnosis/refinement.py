"""The best η of a candidate, searched with everything else fitted anew at every step."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.optimize import minimize

from solver.diagnosis.balance import Balance, CandidateRows, Term
from solver.diagnosis.covariances import Rung
from solver.diagnosis.screening import Gained, beside
from solver.effects.effect import Candidate, Eta

SMALL_STEP = 0.1  # of the first step, for derivatives by η
AGAIN = 0.3  # of the first step, where a search starts from what another one found
CLOSE = 0.05  # in steps and nats: the rest is left to the derivatives


def refined(balance: Balance, term: Term, others: Sequence[Term], rung: Rung) -> Term:
    """The term at its best η, with derivatives by η as further columns; unchanged where all acts linearly.

    A term that was refined already, at another rung, is sought near its η.
    """
    candidate = term.candidate
    steps = np.array(candidate.steps())
    if not len(steps):
        return term
    reach = AGAIN if term.tangent_mean else 1.0
    prior = np.array(candidate.prior(balance.scenes))
    others_there = beside(others, rung)
    tried: dict[Eta, _Tried | None] = {}

    def at(eta: Eta) -> _Tried | None:
        if eta not in tried:
            rows = balance.rows_of(candidate, eta) if candidate.admissible(eta) else None
            tried[eta] = None if rows is None else _Tried(rows, others_there.gain(rows))
        return tried[eta]

    def possible(one: _Tried) -> bool:
        nothing = tuple(0.0 for _ in one.rows.eta)
        return candidate.is_possible(
            candidate.estimates(balance.scenes, one.rows.eta, nothing, one.gained.x, one.gained.covariance)
        )

    def cost(z: np.ndarray) -> float:
        eta = np.array(start) + steps * z
        found = at(tuple(eta.tolist()))
        if found is None or (start_possible and not possible(found)):
            return np.inf
        return 0.5 * float((((eta - prior[:, 0]) / prior[:, 1]) ** 2).sum()) - found.gained.log_evidence

    start = term.eta
    first = at(start)
    start_possible = first is not None and possible(first)
    simplex = np.concatenate([np.zeros((1, len(steps))), reach * np.eye(len(steps))])
    found = minimize(
        cost,
        np.zeros(len(steps)),
        method="Nelder-Mead",
        options={"initial_simplex": simplex, "xatol": CLOSE, "fatol": CLOSE, "maxfev": 30 * len(steps)},
    )
    eta = tuple((np.array(start) + steps * found.x).tolist())
    best = at(eta)
    return term if best is None else _with_tangents(balance, balance.spread(best.rows), best.gained.x, steps)


@dataclass(frozen=True, eq=False)
class _Tried:
    """A candidate at one η beside the others."""

    rows: CandidateRows
    gained: Gained


def _with_tangents(
    balance: Balance, term: Term, x: Float[np.ndarray, " parameters"], steps: Float[np.ndarray, " etas"]
) -> Term:
    """Linearized about its η: fixed + columns x + T (η − mean), η's prior that of the candidate."""
    candidate = term.candidate
    tangents = []
    for i, step in enumerate(SMALL_STEP * steps):
        ahead, behind = (_shifted(candidate, term.eta, i, sign * step) for sign in (1, -1))
        ends = [(e, balance.term(candidate, e) if candidate.admissible(e) else term) for e in (ahead, behind)]
        (high, up), (low, down) = [(e if t is not term else term.eta, t) for e, t in ends]
        width = high[i] - low[i]
        tangents.append(
            (_prediction(up, x) - _prediction(down, x)) / width if width else np.zeros(len(balance.residual))
        )
    T = np.stack(tangents, axis=1)
    prior = np.array(candidate.prior(balance.scenes))
    fixed = T @ (prior[:, 0] - np.array(term.eta))
    if term.fixed is not None:
        fixed = fixed + term.fixed
    return Term(
        candidate,
        term.eta,
        fixed,
        np.concatenate([term.columns, T], axis=1),
        np.concatenate([term.prior_std, prior[:, 1]]),
        tangent_mean=tuple(prior[:, 0].tolist()),
    )


def _shifted(candidate: Candidate, eta: Eta, i: int, by: float) -> Eta:
    return tuple(value + by if k == i else value for k, value in enumerate(eta))


def _prediction(term: Term | None, x: np.ndarray) -> np.ndarray:
    assert term is not None
    product = term.columns @ x
    return product if term.fixed is None else product + term.fixed
