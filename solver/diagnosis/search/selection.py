"""Which causes explain the balance: a search, anew beyond a gross error; and what reading already undid."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from solver.common.progress import Progress, silent
from solver.diagnosis.cause_decisions import Trail
from solver.diagnosis.causes.effect import Candidate, Corrected
from solver.diagnosis.causes.gross_cause import Beyond, GrossCause, correct_scene
from solver.diagnosis.causes.observed_trial import Scene
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.contenders import EXCHANGE_NATS, Contender, Found
from solver.diagnosis.search.proposed_causes import OnReading
from solver.diagnosis.search.search import Search
from solver.diagnosis.search.terms import Solved, Term


@dataclass(frozen=True, eq=False)
class CorrectedCause:
    """A cause that reading the files undid."""

    contender: Contender
    target: str  # as all other causes, in the recording whose gross errors are corrected

    @property
    def key(self) -> tuple[str, str]:
        """Id and target."""
        return self.contender.term.candidate.id, self.target


def find_corrected_on_reading(
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
        fixed = np.zeros(len(balance.residual))  # of a scale's reading as well
        for t, start in zip(balance.trials, balance.start, strict=False):
            wrench = candidate.uncorrected_ground(t.scene) - t.scene.measured_ground
            fixed[start : start + len(t.residual)] = t.reduce(wrench)
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


@dataclass(frozen=True, eq=False)
class Selection:
    """Causes in the order in which they were found."""

    null: Solved
    solved: Solved
    found: tuple[Found, ...]
    corrected: tuple[CorrectedCause, ...] = field(default=())  # undone on reading already
    uncorrected: tuple[Term, ...] = field(default=())  # what these would add to the balance
    trail: Trail = field(default_factory=Trail)  # what was decided on the way
    candidates: int = 1  # among which it was made
    ended_early: bool = False  # before all was tried, at the most evaluations


def select(
    balance: Balance,
    candidates: Sequence[Candidate],
    progress: Progress = silent,
    candidates_of: Callable[[Sequence[Scene]], Sequence[Candidate]] | None = None,
) -> Selection:
    """Add causes one after another while each pays, in evidence and on held-out blocks.

    Args:
        balance: of all trials.
        candidates: the whole catalogue at every target.
        progress: told the fraction done; may raise `Cancelled`.
        candidates_of: the same of trials whose gross error was corrected, as contacts and steps are sought
            where force lacks; None: `candidates` as they are.
    """
    corrections = [c for c in candidates if isinstance(c, Corrected)]
    others = [c for c in candidates if not isinstance(c, Corrected)]
    search = _beyond_gross_errors(Search(balance, others, progress), others, progress, candidates_of)
    named, uncorrected = find_corrected_on_reading(balance, corrections, search.solved, search.trail)
    return Selection(
        search.null,
        search.solved,
        tuple(search.found),
        named,
        uncorrected,
        search.trail,
        len(candidates),
        search.ended_early,
    )


def _beyond_gross_errors(
    search: Search,
    candidates: Sequence[Candidate],
    progress: Progress,
    candidates_of: Callable[[Sequence[Scene]], Sequence[Candidate]] | None,
) -> Search:
    """The search again from the first gross error that it found, other causes in the recording corrected.

    It stays where it does as well: the same causes then have the plates' right names.
    """
    first = next((f for f in search.found if isinstance(f.contender.term.candidate, GrossCause)), None)
    if first is None or search.ended_early:
        return search
    gross = first.contender.term.candidate
    assert isinstance(gross, GrossCause)
    anew = candidates
    if candidates_of is not None:
        anew = candidates_of([correct_scene(gross, scene) for scene in search.balance.scenes])
    beyond: list[Candidate] = [c for c in candidates if isinstance(c, GrossCause)]
    beyond += [Beyond(c.target, c, gross) for c in anew if not isinstance(c, GrossCause | Corrected)]
    again = Search(search.balance, beyond, progress, [first])
    least = search.solved.log_evidence - EXCHANGE_NATS
    return again if again.solved.log_evidence > least else search
