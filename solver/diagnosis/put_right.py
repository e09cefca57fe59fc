"""Causes that reading the files has put right already, and that are still to be named."""

from collections.abc import Sequence

import numpy as np

from solver.diagnosis.balance import Balance, Solved, Term
from solver.diagnosis.contenders import Contender
from solver.effects.effect import Corrected


def put_right_on_reading(
    balance: Balance, corrections: Sequence[Corrected], current: Solved
) -> tuple[tuple[Contender, ...], tuple[Term, ...]]:
    """Causes that reading the files undid, where leaving them in would cost evidence."""
    named, terms = [], []
    for candidate in corrections:
        fixed = np.concatenate(
            [
                t.reduced(candidate.uncorrected_ground(t.scene) - t.scene.measured_ground)
                for t in balance.trials
            ]
        )
        nothing = np.zeros((len(fixed), 0))
        with_it = Term(candidate, (), fixed, nothing, np.zeros(0))
        gain = current.log_evidence - balance.solve([*current.terms, with_it], near=current.rung).log_evidence
        without = balance.term(candidate, ())
        if without is None or gain < balance.settings.least_gain:
            continue
        solved = balance.solve_at([without], current.rung)
        if candidate.is_notable(solved.estimates(0, balance.scenes)):
            named.append(Contender(without, solved, gain))
            terms.append(with_it)
    return tuple(named), tuple(terms)
