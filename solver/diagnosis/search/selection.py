"""Which causes explain the balance: a search over the catalogue, anew beyond a gross error."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from solver.common.progress import Progress, silent
from solver.diagnosis.causes.effect import Candidate, Corrected
from solver.diagnosis.causes.gross_cause import Beyond, GrossCause, corrected
from solver.diagnosis.causes.scene import Scene
from solver.diagnosis.corrected_causes import CorrectedCause, corrected_on_reading
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.contenders import EXCHANGE_NATS, Found
from solver.diagnosis.search.search import Search
from solver.diagnosis.search.terms import Solved, Term
from solver.diagnosis.trail import Trail


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
    named, uncorrected = corrected_on_reading(balance, corrections, search.solved, search.trail)
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
        anew = candidates_of([corrected(gross, scene) for scene in search.balance.scenes])
    beyond: list[Candidate] = [c for c in candidates if isinstance(c, GrossCause)]
    beyond += [Beyond(c.target, c, gross) for c in anew if not isinstance(c, GrossCause | Corrected)]
    again = Search(search.balance, beyond, progress, [first])
    least = search.solved.log_evidence - EXCHANGE_NATS
    return again if again.solved.log_evidence > least else search
