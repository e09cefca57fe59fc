"""Causes that reading the files has corrected already, and that are still to be named."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from solver.diagnosis.causes.effect import Corrected
from solver.diagnosis.causes.gross_cause import GrossCause
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.contenders import Contender
from solver.diagnosis.search.proposals import OnReading
from solver.diagnosis.search.terms import Solved, Term
from solver.diagnosis.trail import Trail


@dataclass(frozen=True, eq=False)
class CorrectedCause:
    """A cause that reading the files undid."""

    contender: Contender
    target: str  # as all other causes, in the recording whose gross errors are corrected

    @property
    def key(self) -> tuple[str, str]:
        """Id and target."""
        return self.contender.term.candidate.id, self.target


def corrected_on_reading(
    balance: Balance, corrections: Sequence[Corrected], current: Solved, trail: Trail
) -> tuple[tuple[CorrectedCause, ...], tuple[Term, ...]]:
    """Causes that reading the files undid, where leaving them in would cost evidence.

    Args:
        balance: of all trials.
        corrections: what reading may have undone, by the names that the files give.
        current: the causes that were found.
        trail: where they are decided on.
    """
    gross = [t.candidate for t in current.terms if isinstance(t.candidate, GrossCause)]
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
        gain = (
            current.log_evidence
            - balance.solve([*current.terms, with_it], near=current.noise_scale).log_evidence
        )
        without = balance.term(candidate, ())
        if without is None:
            continue
        contender = Contender(without, balance.solve_at([without], current.noise_scale), gain)
        if trail.put(OnReading(balance, contender, current)).fell_at is None:
            target = candidate.target
            for error in gross:
                target = error.target_corrected(target)
            named.append(CorrectedCause(contender, target))
            terms.append(with_it)
    return tuple(named), tuple(terms)
