"""From which size on a cause would have been found in a sound recording: what "nothing wrong" is worth.

A cause of size x whose parameter the recording alone tells with standard deviation σ shows as y ~ N(x, σ²).
With the prior N(0, p²) it gains ½ (y / σ)² / (1 + (σ / p)²) − ½ log det M nats, where M is the information of
all its parameters in units of their priors. It is found where that exceeds what is asked of a first cause and
y is large enough to act on. Only causes of few parameters that act all along are asked: a contact or a step
differs from the next by its time history.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from solver.diagnosis.causes.effect import Candidate, Estimate, Fitted
from solver.diagnosis.checks import least_first_gain
from solver.diagnosis.diagnosis import Detectable
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.contenders import handicap
from solver.diagnosis.search.refinement import refine
from solver.diagnosis.search.terms import Solved, Term

NINE_IN_TEN = 1.28  # standard deviations by which an estimate falls short at most
GRID = np.geomspace(0.05, 50.0, 200)  # of standard deviations, among which a size to act on is sought


def find_detectable(
    balance: Balance, null: Solved, candidates: Sequence[Candidate]
) -> tuple[Detectable, ...]:
    """Sizes for each parameter of the most usual causes.

    Args:
        balance: of all trials.
        null: its fit without any cause.
        candidates: the catalogue; others than those asked are left out.
    """
    found = []
    for candidate in candidates:
        if candidate.about.asked_up_to is None:
            continue
        least_eta = min(candidate.starts(balance.scenes), key=lambda eta: float(np.square(eta).sum()))
        term = balance.term(candidate, least_eta)
        if term is None:
            continue
        solved = balance.solve_at([refine(balance, term, [], null.noise_scale)], null.noise_scale)
        needed = least_first_gain(candidate, null.noise_scale.scale, balance.settings)
        needed += handicap(candidate, balance.settings)
        cost = float(np.log(np.diag(solved.root)).sum())  # ½ log det M
        prior = _estimates_at_nothing(candidate, balance, solved.terms[0], solved.terms[0].prior_std)
        for name, estimate in solved.estimates(0, balance.scenes).items():
            p, left = prior[name].std, estimate.std
            if not 0 < left < p:
                continue
            alone = (left**-2 - p**-2) ** -0.5
            by_evidence = alone * np.sqrt(2 * max(0.0, needed + cost) * (1 + (alone / p) ** 2))
            to_act_on = _to_act_on(candidate, balance, solved.terms[0], name, alone)
            size = max(float(by_evidence), to_act_on) + NINE_IN_TEN * alone
            if np.isfinite(size):
                found.append(Detectable(candidate.id, candidate.target, name, size))
    return tuple(found)


def _estimates_at_nothing(
    candidate: Candidate, balance: Balance, term: Term, std: Float[np.ndarray, " parameters"]
) -> dict[str, Estimate]:
    """The catalogue's parameters where there is nothing, with given standard deviations of x and η."""
    linear = len(std) - len(term.tangent_mean)
    x, covariance = np.zeros(linear), np.diag(std[:linear] ** 2)
    no_eta = tuple(0.0 for _ in term.eta)
    return candidate.estimates(balance.scenes, Fitted(no_eta, tuple(std[linear:].tolist()), x, covariance))


def _to_act_on(candidate: Candidate, balance: Balance, term: Term, name: str, std: float) -> float:
    """The least size of one parameter, all others at nothing, that anybody would act on."""
    nothing = _estimates_at_nothing(candidate, balance, term, np.zeros(len(term.prior_std)))
    for size in GRID * std:
        larger = replace(nothing[name], value=nothing[name].value + size)
        if candidate.is_notable({**nothing, name: larger}):
            return float(size)
    return float("inf")
