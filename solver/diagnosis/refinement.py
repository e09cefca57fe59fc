"""The best η of a candidate, searched with everything else fitted anew at every step."""

from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize

from solver.diagnosis.balance import Balance, Rung, Solved, Term
from solver.effects.effect import Candidate, Eta

SMALL_STEP = 0.1  # of the first step, for derivatives by η


def refined(balance: Balance, term: Term, others: Sequence[Term], rung: Rung) -> Term:
    """The term at its best η, with derivatives by η as further columns; unchanged where all acts linearly."""
    candidate = term.candidate
    steps = np.array(candidate.steps())
    if not len(steps):
        return term
    prior = np.array(candidate.prior(balance.scenes))
    tried: dict[Eta, tuple[Term, Solved] | None] = {}

    def at(eta: Eta) -> tuple[Term, Solved] | None:
        if eta not in tried:
            made = balance.term(candidate, eta) if candidate.admissible(eta) else None
            tried[eta] = None if made is None else (made, balance.solve_at([*others, made], rung))
        return tried[eta]

    def possible(solved: Solved) -> bool:
        return candidate.is_possible(solved.estimates(len(others), balance.scenes))

    def cost(z: np.ndarray) -> float:
        eta = np.array(start) + steps * z
        found = at(tuple(eta.tolist()))
        if found is None or (start_possible and not possible(found[1])):
            return np.inf
        return 0.5 * float((((eta - prior[:, 0]) / prior[:, 1]) ** 2).sum()) - found[1].log_evidence

    start = term.eta
    first = at(start)
    start_possible = first is not None and possible(first[1])
    simplex = np.concatenate([np.zeros((1, len(steps))), np.eye(len(steps))])
    found = minimize(
        cost,
        np.zeros(len(steps)),
        method="Nelder-Mead",
        options={"initial_simplex": simplex, "xatol": 0.02, "fatol": 0.02, "maxfev": 30 * len(steps)},
    )
    eta = tuple((np.array(start) + steps * found.x).tolist())
    best = at(eta)
    return term if best is None else _with_tangents(balance, *best, steps=steps)


def _with_tangents(balance: Balance, term: Term, solved: Solved, *, steps: np.ndarray) -> Term:
    """Linearized about its η: fixed + columns x + T (η − mean), η's prior that of the candidate."""
    candidate = term.candidate
    x = solved.of(len(solved.terms) - 1)[0]
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
