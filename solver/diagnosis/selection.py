"""Which causes explain the balance: screened, refitted, added one by one, and held to unseen blocks."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Int

from solver.diagnosis.balance import Balance, Rung, Solved, Term
from solver.diagnosis.heldout import block_scores, blocks
from solver.diagnosis.refinement import best_start, refined
from solver.diagnosis.settings import DiagnosisSettings
from solver.effects.effect import Candidate, Corrected
from solver.progress import Progress, silent


@dataclass(frozen=True, eq=False)
class Contender:
    """A candidate fitted beside the causes found before it."""

    term: Term
    solved: Solved
    gain: float  # log evidence beyond those

    def odds_gain(self, settings: DiagnosisSettings) -> float:
        """The gain less the log prior odds against the cause [nats]."""
        return self.gain - handicap(self.term.candidate, settings)


@dataclass(frozen=True, eq=False)
class Found:
    """A cause, and what else might be in its place."""

    contender: Contender
    heldout_gain: float  # log density of withheld blocks beyond the causes found before
    rivals: tuple[Contender, ...]  # others that were tried in its place, best first


@dataclass(frozen=True, eq=False)
class Selection:
    """Causes in the order in which they were found."""

    null: Solved
    solved: Solved
    found: tuple[Found, ...]
    refused: tuple[Contender, ...] = field(default=())  # the best of the last round, that did not pay
    corrected: tuple[Contender, ...] = field(default=())  # undone on reading already
    uncorrected: tuple[Term, ...] = field(default=())  # what these would add to the balance


def select(balance: Balance, candidates: Sequence[Candidate], progress: Progress = silent) -> Selection:
    """Add causes one after another while each pays, in evidence and on withheld blocks.

    Args:
        balance: of all trials.
        candidates: the whole catalogue at every target.
        progress: told the fraction done; may raise `Cancelled`.
    """
    settings = balance.settings
    corrections = [c for c in candidates if isinstance(c, Corrected)]
    candidates = [c for c in candidates if not isinstance(c, Corrected)]
    current = null = balance.solve([])
    found: list[Found] = []
    some = blocks(balance)
    contenders: list[Contender] = []
    for turn in range(settings.most_effects):
        progress("diagnosis", turn / settings.most_effects)
        contenders = _contenders(balance, candidates, current, [f.contender.term for f in found])
        best = None
        least = settings.least_further_gain if found else settings.least_gain
        for contender in contenders:
            if contender.odds_gain(settings) < least:
                continue
            heldout = _heldout_gain(balance, current, contender.solved, some)
            if heldout > settings.least_heldout_gain and _notable(balance, contender.solved):
                best = contender, heldout
                break
        if best is None or _ambiguous(best[0], contenders, settings):
            break
        contender, heldout = best
        rivals = tuple(c for c in contenders if c is not contender)
        found.append(Found(contender, heldout, rivals))
        current = contender.solved
        current, found = _settled(balance, current, found)
    progress("diagnosis", 1.0)
    named, uncorrected = _corrected(balance, corrections, current)
    return Selection(null, current, tuple(found), tuple(contenders[:5]), named, uncorrected)


def _corrected(
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


def _contenders(
    balance: Balance, candidates: Sequence[Candidate], current: Solved, accepted: Sequence[Term]
) -> list[Contender]:
    """The most promising candidates, refined, each with the scale that suits it; best first."""
    settings = balance.settings
    taken = {(t.candidate.id, t.candidate.target) for t in accepted}
    fresh = [c for c in candidates if (c.id, c.target) not in taken]
    rungs = {id(r): r for r in (current.rung, _nearest(balance.rungs, 1.0))}.values()
    chosen: dict[int, Term] = {}
    for rung in rungs:
        base = balance.solve_at(accepted, rung).log_evidence
        screened = []
        for candidate in fresh:
            start = best_start(balance, candidate, accepted, rung)
            if start is not None:
                screened.append((start[1].log_evidence - base - handicap(candidate, settings), start[0]))
        screened.sort(key=lambda s: -s[0])
        for _, term in screened[: settings.refitted]:
            chosen.setdefault(id(term.candidate), term)
    contenders = []
    for term in chosen.values():
        own = refined(balance, term, accepted, current.rung)
        solved = balance.solve([*accepted, own], near=current.rung)
        if solved.rung is not current.rung and own.tangent_mean:
            own = refined(balance, term, accepted, solved.rung)
            solved = balance.solve([*accepted, own], near=solved.rung)
        contenders.append(Contender(own, solved, solved.log_evidence - current.log_evidence))
    return sorted(contenders, key=lambda c: -c.odds_gain(settings))


def handicap(candidate: Candidate, settings: DiagnosisSettings) -> float:
    """Log prior odds against the cause [nats]."""
    return dict(settings.handicaps).get(candidate.id, 0.0)


def _settled(balance: Balance, current: Solved, found: list[Found]) -> tuple[Solved, list[Found]]:
    """Causes that no longer pay once later ones are there are taken back."""
    while len(found) > 1:
        terms = [f.contender.term for f in found]
        without = [balance.solve(terms[:k] + terms[k + 1 :], near=current.rung) for k in range(len(terms))]
        losses = [current.log_evidence - w.log_evidence for w in without]
        k = int(np.argmin(losses))
        if losses[k] >= balance.settings.least_gain + handicap(
            found[k].contender.term.candidate, balance.settings
        ):
            break
        found = found[:k] + found[k + 1 :]
        current = without[k]
    return current, found


def _heldout_gain(
    balance: Balance, before: Solved, after: Solved, some: Sequence[Int[np.ndarray, " rows"]]
) -> float:
    """Sum over blocks of what their log density gains."""
    old = block_scores(balance, before.terms, before.rung, some).log_density
    new = block_scores(balance, after.terms, after.rung, some).log_density
    return float((new - old).sum())


def _notable(balance: Balance, solved: Solved) -> bool:
    """Whether the last term's size is one that anybody would act on, and the others' still are."""
    return all(
        term.candidate.is_notable(solved.estimates(k, balance.scenes)) for k, term in enumerate(solved.terms)
    )


def confidence(one: Contender, contenders: Sequence[Contender], settings: DiagnosisSettings) -> float:
    """Share of a cause among none and all that were tried in its place, on tempered log evidence and odds."""
    own = (one.term.candidate.id, one.term.candidate.target)
    others = [
        c.odds_gain(settings) for c in contenders if (c.term.candidate.id, c.term.candidate.target) != own
    ]
    gains = np.array([0.0, *others]) - one.odds_gain(settings)
    return float(1 / (1 + np.exp(np.clip(gains / settings.confidence_temper, -50, 50)).sum()))


def _ambiguous(one: Contender, contenders: Sequence[Contender], settings: DiagnosisSettings) -> bool:
    """Small, and no likelier than a handful of others: what a model's own errors look like."""
    small = one.odds_gain(settings) < settings.certain_gain
    return small and confidence(one, contenders, settings) < settings.least_confidence


def _nearest(rungs: Sequence[Rung], scale: float) -> Rung:
    return min(rungs, key=lambda r: abs(np.log(r.scale / scale)))
