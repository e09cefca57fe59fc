"""The search for causes: screened, refitted, added one by one, exchanged, and held to unseen blocks."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from solver.diagnosis.admission import Admission
from solver.diagnosis.balance import Balance, Solved, Term
from solver.diagnosis.contenders import (
    Contender,
    Found,
    ambiguous,
    handicap,
    least_first_gain,
    loose_ends,
    overlap,
)
from solver.diagnosis.heldout import HeldoutGain, blocks, heldout_gain
from solver.diagnosis.refinement import refined
from solver.diagnosis.screening import Screen
from solver.effects.effect import Candidate
from solver.progress import Progress, silent

MOST_EXCHANGES = 3
SHARPER = 4.0  # so much smaller, the model's error may be beside the right cause


class Search:
    """Causes found so far; grows one by one, or by two where neither stands out alone."""

    def __init__(
        self,
        balance: Balance,
        candidates: Sequence[Candidate],
        progress: Progress,
        found: Sequence[Found] = (),
    ) -> None:
        self.balance, self.settings = balance, balance.settings
        self.admission = Admission(balance)
        self.screen = Screen(balance, candidates)
        self.blocks = blocks(balance)
        self.null = balance.solve([])
        self.found = list(found)
        self.first: Found | None = None  # as it was found
        self.solved = balance.solve(self.terms) if found else self.null
        self._grow(progress)
        if not found:
            self._grow_from_equals()
        for _ in range(MOST_EXCHANGES):
            if len(self.found) < 2 or not self._exchange_all():
                break
            self._grow(progress)
        progress("diagnosis", 1.0)

    def _grow(self, progress: Progress) -> None:
        """Causes added as long as that leads on, and of all sets on the way the likeliest.

        One that makes others needless may leave a less likely set, beside which the next one shows.
        """
        most = self.settings.most_effects
        best, met = (self._odds(), list(self.found), self.solved), {self._names()}
        for turn in range(2 * most):
            progress("diagnosis", turn / (2 * most))
            if len(self.found) >= most or not self._add():
                break
            self._take_back()
            if self._odds() > best[0]:
                best = self._odds(), list(self.found), self.solved
            if self._names() in met:
                break
            met.add(self._names())
        _, self.found, self.solved = best

    def _grow_from_equals(self) -> None:
        """Again from causes that explain something else nearly as well as the first; the outcome decides."""
        if self.first is None:
            return
        best = self._standing(), self.found, self.solved
        among = [self.first.contender, *self.first.rivals]
        tenable = [c for c in among if self.admission.tenable(c.solved, self.null)]
        for one in self._equals(self.first):
            self.found, self.solved = [], self.null
            heldout = self._paying(one, self.null, leads=self._leads(one, tenable))
            enough = one.odds_gain(self.settings) >= self._least_gain(one)
            if heldout is None or not enough or ambiguous(one, tenable, self.settings):
                continue
            self.found = [Found(one, heldout.own_scales, tuple(c for c in among if c is not one))]
            self.solved = one.solved
            self._grow(silent)
            if self._standing() > best[0] + self.settings.exchange_margin:
                best = self._standing(), self.found, self.solved
        _, self.found, self.solved = best

    def _standing(self) -> float:
        """The odds of what was found, ahead where something is seen without any force."""
        seen = any(t.candidate.has_a_witness for t in self.terms)
        return self._odds() + (self.settings.witness_lead if seen else 0.0)

    def _equals(self, first: Found) -> list[Contender]:
        """Others that do nearly as well in the first place, and explain something else: one of each kind."""
        settings = self.settings
        own = first.contender
        margin = max(settings.start_margin, settings.start_share * own.gain)
        kinds: dict[str, Contender] = {}
        for one in sorted(first.rivals, key=self._order):
            near = one.odds_gain(settings) > own.odds_gain(settings) - margin
            if (
                near
                and one.term.candidate.id != own.term.candidate.id
                and overlap(own, one) < settings.same_trace
            ):
                kinds.setdefault(one.term.candidate.id, one)
        return list(kinds.values())[: settings.most_starts]

    def _names(self) -> frozenset[tuple[str, str]]:
        return frozenset(t.candidate.key for t in self.terms)

    def _odds(self) -> float:
        """Log evidence less the log prior odds against what was found, but for a constant [nats]."""
        against = sum(handicap(t.candidate, self.settings) for t in self.terms)
        return self.solved.log_evidence - against

    @property
    def terms(self) -> list[Term]:
        return [f.contender.term for f in self.found]

    def _add(self) -> bool:
        """The best next cause, or the best two together."""
        contenders = self._contenders(self.terms, self.solved)
        tenable = [c for c in contenders if self.admission.tenable(c.solved, self.solved)]
        inadmissible: set[int] = set()
        for contender in contenders:
            if contender.odds_gain(self.settings) < self._least_gain(contender):
                continue
            heldout = self._paying(contender, self.solved, leads=self._leads(contender, tenable))
            if heldout is None:
                inadmissible.add(id(contender))
                continue
            rivals = tuple(c for c in contenders if c is not contender and id(c) not in inadmissible)
            if ambiguous(contender, tenable, self.settings):
                break
            self.found.append(Found(contender, heldout.own_scales, rivals))
            self.solved = contender.solved
            self.first = self.first or self.found[0]
            return True
        return self._add_two(contenders)

    def _leads(self, one: Contender, tenable: Sequence[Contender]) -> bool:
        return self.admission.leads(one, tenable) and self.admission.notable(one.solved)

    def _paying(self, one: Contender, before: Solved, *, leads: bool = False) -> HeldoutGain | None:
        """Its gain on withheld blocks, if that is enough and nothing else speaks against the cause."""
        heldout = self._heldout_gain(one.solved, before)
        beyond = heldout.best + one.term.candidate.seen_elsewhere
        if (
            beyond <= self._least_heldout_gain(one)
            or not (leads or self.admission.admissible(one.solved, before))
            or self.admission.undoes_the_others(one.solved)
        ):
            return None
        return heldout

    def _least_gain(self, contender: Contender) -> float:
        if self.found:
            return self._least_further_gain()
        return least_first_gain(contender.term.candidate, contender.solved.rung.scale, self.settings)

    def _least_further_gain(self) -> float:
        return self.settings.least_further_gain + loose_ends(self.found, self.settings)

    def _add_two(self, contenders: Sequence[Contender]) -> bool:
        """Two causes of which neither stands out alone, but both together."""
        settings = self.settings
        able = [c for c in contenders if c.odds_gain(settings) > settings.least_of_two]
        tried = []
        for one, two in combinations(able[: settings.tried_in_pairs], 2):
            both = self.balance.solve([*self.terms, one.term, two.term], near=one.solved.rung)
            gain = both.log_evidence - self.solved.log_evidence
            odds = gain - handicap(one.term.candidate, settings) - handicap(two.term.candidate, settings)
            tried.append((odds, one, two, both))
        tried.sort(key=lambda t: -t[0])
        least = settings.least_gain + settings.least_further_gain
        if not tried or tried[0][0] < least:
            return False
        odds, one, two, both = tried[0]
        if not (self.admission.admissible(both, self.solved) and self.admission.notable(both, -2)):
            return False
        alone = max(one.odds_gain(settings), two.odds_gain(settings))
        heldout = self._heldout_gain(both, self.solved)
        runner_up = tried[1][0] if len(tried) > 1 else -np.inf
        if (
            odds - alone < self._least_further_gain()
            or odds - runner_up < settings.rival_margin
            or heldout.best <= settings.least_heldout_gain
        ):
            return False
        for own, other in ((one, two), (two, one)):
            gain = both.log_evidence - other.solved.log_evidence
            self.found.append(Found(Contender(own.term, both, gain), heldout.own_scales, ()))
        self.solved = both
        return True

    def _take_back(self) -> None:
        """Causes that are too small or no longer pay once later ones are there."""
        while self.found:
            terms = self.terms
            without = [
                self.balance.solve(terms[:k] + terms[k + 1 :], near=self.solved.rung)
                for k in range(len(terms))
            ]
            losses = [
                self.solved.log_evidence - w.log_evidence - handicap(t.candidate, self.settings)
                for w, t in zip(without, terms, strict=True)
            ]
            weak = [
                k
                for k, loss in enumerate(losses)
                if (loss < self.settings.least_gain and len(terms) > 1)
                or not self.admission.notable(self.solved, k)
            ]
            if not weak:
                break
            k = min(weak, key=lambda k: losses[k])
            del self.found[k]
            self.solved = without[k]

    def _exchange_all(self) -> bool:
        """Each cause anew beside all others, and whether another took the place of one."""
        before = [t.candidate.key for t in self.terms]
        for k in range(len(self.found)):
            self._exchange(k)
        self._take_back()
        return before != [t.candidate.key for t in self.terms]

    def _exchange(self, k: int) -> None:
        """The k-th cause against all others in its place, beside the rest."""
        one = self.found[k]
        rest = self.terms[:k] + self.terms[k + 1 :]
        without = self.balance.solve(rest, near=self.solved.rung)
        contenders = self._contenders(rest, without)
        key = one.contender.term.candidate.key
        gain = self.solved.log_evidence - without.log_evidence
        own = Contender(one.contender.term, self.solved, gain)
        contenders = [own, *(c for c in contenders if c.term.candidate.key != key)]
        contenders.sort(key=lambda c: -c.odds_gain(self.settings))
        least = own.odds_gain(self.settings) + self.settings.exchange_margin
        chosen, heldout, inadmissible = own, one.heldout_gain, set()
        for c in contenders:
            if c is own or c.odds_gain(self.settings) < least:
                break
            paying = self._paying(c, without)
            if paying is not None and all(self.admission.notable(c.solved, i) for i in range(len(rest))):
                chosen, heldout = c, paying.own_scales
                terms = [*self.terms[:k], chosen.term, *self.terms[k + 1 :]]
                self.solved = self.balance.solve(terms, near=chosen.solved.rung)
                break
            inadmissible.add(id(c))
        rivals = tuple(c for c in contenders if c is not chosen and id(c) not in inadmissible)
        self.found[k] = Found(chosen, heldout, rivals)

    def _contenders(self, accepted: Sequence[Term], current: Solved) -> list[Contender]:
        """The most promising candidates, refined, each with the scale that suits it; best first."""
        balance, settings = self.balance, self.settings
        scales, slack = (current.rung.scale, 1.0, current.rung.scale / SHARPER), current.rung.slack
        rungs = {id(r): r for r in (balance.ladder.nearest(s, slack) for s in scales)}.values()
        chosen: dict[tuple[str, str], Term] = {}
        for rung in rungs:
            for one in self.screen.by_name(rung, accepted)[: settings.refitted]:
                if one.rows.candidate.key not in chosen:
                    chosen[one.rows.candidate.key] = balance.spread(one.rows)
        contenders = []
        refitted = [refined(balance, term, accepted, current.rung) for term in chosen.values()]
        balance.whiten_ahead(refitted, current.rung)
        for term in refitted:
            own, solved = term, balance.solve([*accepted, term], near=current.rung)
            if solved.rung is not current.rung and own.tangent_mean:
                own = refined(balance, own, accepted, solved.rung)
                solved = balance.solve([*accepted, own], near=solved.rung)
            contenders.append(Contender(own, solved, solved.log_evidence - current.log_evidence))
        return sorted(contenders, key=self._order)

    def _order(self, one: Contender) -> float:
        """Least first: who is tried first; what is seen without any force goes before its equals."""
        lead = self.settings.witness_lead if one.term.candidate.has_a_witness else 0.0
        return -one.odds_gain(self.settings) - lead

    def _heldout_gain(self, after: Solved, before: Solved) -> HeldoutGain:
        return heldout_gain(self.balance, self.blocks, before, after)

    def _least_heldout_gain(self, one: Contender) -> float:
        """Less of what lasts, and of masses, of which withheld blocks hardly tell."""
        candidate, settings = one.term.candidate, self.settings
        if candidate.of_any_course:
            return settings.least_heldout_gain
        share = settings.mass_heldout_share if candidate.is_a_mass else settings.heldout_share
        return settings.least_heldout_gain - share * one.gain
