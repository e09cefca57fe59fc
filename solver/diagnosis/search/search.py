"""The search for causes: screened, refitted, proposed one by one, in pairs, exchanged; `decisions` decide."""

from collections.abc import Sequence
from itertools import combinations, islice

import numpy as np

from solver.common.progress import Progress, silent
from solver.diagnosis.bounded_cache import Memory
from solver.diagnosis.cause_decisions import Trail, tenable
from solver.diagnosis.causes.effect import Candidate
from solver.diagnosis.checks import DECIDED, about_the_suspect
from solver.diagnosis.held_out_gain import blocks
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.contenders import EXCHANGE_NATS, SAME_TRACE, Contender, Found, handicap, overlap
from solver.diagnosis.search.proposed_causes import Added, Exchanged, Kept, Paired
from solver.diagnosis.search.refinement import refine
from solver.diagnosis.search.screening import Screen
from solver.diagnosis.search.terms import Solved, Term

REFITTED_CAUSES = 10  # the best of the screening; a cause that matters is among them
LEAST_OF_TWO_NATS = 4.0  # of each of two causes alone, that may stand out only together
TRIED_IN_PAIRS = 6  # the best of the refitted, each with each
START_MARGIN_NATS = 6.0  # within which another first cause is tried as well: what it leads to decides
START_SHARE = 0.05  # of the gain, likewise
MOST_STARTS = 2  # likewise, beside the first; each takes as long
# by which others must do better than a foot that is seen to stand where nothing measures, to be tried
# before it
SEEN_STANDING_NATS = 10.0
MOST_EXCHANGES = 3
MOST_MET_BYTES = 300e6  # rows of contenders beside sets of causes that may be met again
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
        self.trail = Trail()
        self.screen = Screen(balance, candidates)
        self.blocks = blocks(balance)
        self.null = balance.solve([])
        self._met = Memory(MOST_MET_BYTES)
        self.found = list(found)
        self.first: Found | None = None  # as it was found
        self.solved = balance.solve(self.terms) if found else self.null
        self.ended_early = False  # before all was tried, at the most evaluations
        self._grow(progress)
        if not found:
            self._grow_from_equals()
        for _ in range(MOST_EXCHANGES):
            if len(self.found) < 2 or self._ends() or not self._exchange_all():
                break
            self._grow(progress)
        for proposal in self._kept():
            self.trail.put(proposal)
        progress("diagnosis", 1.0)

    def _ends(self) -> bool:
        """Whether the search has had its evaluations: what was found so far stays."""
        self.ended_early = self.ended_early or self.balance.is_exhausted
        return self.ended_early

    def _grow(self, progress: Progress) -> None:
        """Causes added as long as that leads on, and of all sets on the way the likeliest.

        One that makes others needless may leave a less likely set, beside which the next one shows.
        """
        most = self.settings.most_effects
        best, met = (self._odds(), list(self.found), self.solved), {self._names()}
        for turn in range(2 * most):
            progress("diagnosis", turn / (2 * most))
            if len(self.found) >= most or self._ends() or not self._add():
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
        likely = tenable(self.balance, among, self.null)
        for one in self._equals(self.first):
            if self._ends():
                break
            self.found, self.solved = [], self.null
            proposal = Added(self.balance, one, self.null, self.blocks, (), likely)
            if self.trail.put(proposal).fell_at is not None:
                continue
            rivals = tuple(c for c in among if c is not one)
            self.found = [Found(one, proposal.held_out.own_scales, rivals)]
            self.solved = one.solved
            self._grow(silent)
            if self._standing() > best[0] + EXCHANGE_NATS:
                best = self._standing(), self.found, self.solved
        _, self.found, self.solved = best

    def _standing(self) -> float:
        """The odds of what was found, ahead where something is seen without any force."""
        seen = any(t.candidate.about.seen_standing for t in self.terms)
        return self._odds() + (SEEN_STANDING_NATS if seen else 0.0)

    def _equals(self, first: Found) -> list[Contender]:
        """Others that do nearly as well in the first place, and explain something else: one of each kind."""
        settings = self.settings
        own = first.contender
        margin = max(START_MARGIN_NATS, START_SHARE * own.gain)
        kinds: dict[str, Contender] = {}
        for one in sorted(first.rivals, key=self._order):
            near = one.odds_gain(settings) > own.odds_gain(settings) - margin
            if near and one.term.candidate.id != own.term.candidate.id and overlap(own, one) < SAME_TRACE:
                kinds.setdefault(one.term.candidate.id, one)
        return list(kinds.values())[:MOST_STARTS]

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
        likely = tenable(self.balance, contenders, self.solved)
        inadmissible = {
            id(c) for c in contenders if not about_the_suspect([c.term.candidate.key], self.balance)
        }
        for one in contenders:
            proposal = Added(self.balance, one, self.solved, self.blocks, tuple(self.found), likely)
            verdict = self.trail.put(proposal)
            if verdict.fell_at == DECIDED:
                break
            if verdict.fell_at is not None:
                inadmissible |= {id(one)} if verdict.pays else set()
                continue
            rivals = tuple(c for c in contenders if c is not one and id(c) not in inadmissible)
            self.found.append(Found(one, proposal.held_out.own_scales, rivals))
            self.solved = one.solved
            self.first = self.first or self.found[0]
            return True
        return not self._ends() and self._add_two(contenders)

    def _add_two(self, contenders: Sequence[Contender]) -> bool:
        """Two causes of which neither stands out alone, but both together."""
        settings = self.settings
        able = [c for c in contenders if c.odds_gain(settings) > LEAST_OF_TWO_NATS]
        tried = []
        for one, two in combinations(able[:TRIED_IN_PAIRS], 2):
            both = self.balance.solve([*self.terms, one.term, two.term], near=one.solved.noise_scale)
            gain = both.log_evidence - self.solved.log_evidence
            odds = gain - handicap(one.term.candidate, settings) - handicap(two.term.candidate, settings)
            tried.append((odds, one, two, Contender(two.term, both, gain)))
        tried.sort(key=lambda t: -t[0])
        if not tried:
            return False
        _, one, two, both_beside = tried[0]
        runner_up = tried[1][0] if len(tried) > 1 else -np.inf
        proposal = Paired(
            self.balance,
            both_beside,
            self.solved,
            self.blocks,
            others=tuple(self.found),
            one=one,
            two=two,
            runner_up=runner_up,
        )
        if self.trail.put(proposal).fell_at is not None:
            return False
        both = both_beside.solved
        for own, other in ((one, two), (two, one)):
            gain = both.log_evidence - other.solved.log_evidence
            self.found.append(Found(Contender(own.term, both, gain), proposal.held_out.own_scales, ()))
        self.solved = both
        return True

    def _take_back(self) -> None:
        """Causes that are too small or no longer pay once later ones are there."""
        while self.found:
            kept = self._kept()
            weak = [k for k, one in enumerate(kept) if self.trail.put(one).fell_at is not None]
            if not weak:
                break
            k = min(weak, key=lambda k: kept[k].odds)
            del self.found[k]
            self.solved = kept[k].without

    def _kept(self) -> list[Kept]:
        """Each cause, and the set without it."""
        terms, near = self.terms, self.solved.noise_scale
        proposals = []
        for k, term in enumerate(terms):
            without = self.balance.solve(terms[:k] + terms[k + 1 :], near=near)
            gain = self.solved.log_evidence - without.log_evidence
            proposals.append(Kept(self.balance, Contender(term, self.solved, gain), without))
        return proposals

    def _exchange_all(self) -> bool:
        """Each cause anew beside all others, and whether another took the place of one."""
        before = [t.candidate.key for t in self.terms]
        for k in range(len(self.found)):
            if not self._ends():
                self._exchange(k)
        self._take_back()
        return before != [t.candidate.key for t in self.terms]

    def _exchange(self, k: int) -> None:
        """The k-th cause against all others in its place, beside the rest."""
        one = self.found[k]
        rest = self.terms[:k] + self.terms[k + 1 :]
        without = self.balance.solve(rest, near=self.solved.noise_scale)
        contenders = self._contenders(rest, without)
        key = one.contender.term.candidate.key
        gain = self.solved.log_evidence - without.log_evidence
        own = Contender(one.contender.term, self.solved, gain)
        contenders = [own, *(c for c in contenders if c.term.candidate.key != key)]
        contenders.sort(key=lambda c: -c.odds_gain(self.settings))
        chosen, held_out, inadmissible = own, one.held_out_gain, set()
        for c in contenders:
            if c is own:
                break
            proposal = Exchanged(self.balance, c, without, self.blocks, own)
            verdict = self.trail.put(proposal)
            if not verdict.pays:
                break
            if verdict.fell_at is None:
                chosen, held_out = c, proposal.held_out.own_scales
                terms = [*self.terms[:k], chosen.term, *self.terms[k + 1 :]]
                self.solved = self.balance.solve(terms, near=chosen.solved.noise_scale)
                break
            inadmissible.add(id(c))
        rivals = tuple(c for c in contenders if c is not chosen and id(c) not in inadmissible)
        self.found[k] = Found(chosen, held_out, rivals)

    def _contenders(self, accepted: Sequence[Term], current: Solved) -> list[Contender]:
        """The most promising candidates, refined, each with the scale that suits it; best first.

        Remembered: the same causes are met again when they are exchanged, and after that.
        """
        found = self._met.get(
            lambda: tuple(self._refit(accepted, current)), "contenders", current.noise_scale, *accepted
        )
        return list(found)

    def _refit(self, accepted: Sequence[Term], current: Solved) -> list[Contender]:
        balance = self.balance
        scales, slack = (
            (current.noise_scale.scale, 1.0, current.noise_scale.scale / SHARPER),
            current.noise_scale.slack,
        )
        noise_scales = {id(r): r for r in (balance.noise_grid.nearest(s, slack) for s in scales)}.values()
        chosen: dict[tuple[str, str], Term] = {}
        for noise_scale in noise_scales:
            for one in islice(self.screen.by_name(noise_scale, accepted), REFITTED_CAUSES):
                if one.rows.candidate.key not in chosen:
                    chosen[one.rows.candidate.key] = self.screen.term(one.rows)
        contenders = []
        refitted = [refine(balance, term, accepted, current.noise_scale) for term in chosen.values()]
        balance.see_ahead(refitted, accepted, current.noise_scale)
        for term in refitted:
            own, solved = term, balance.solve([*accepted, term], near=current.noise_scale)
            if solved.noise_scale is not current.noise_scale and own.tangent_mean:
                own = refine(balance, own, accepted, solved.noise_scale)
                solved = balance.solve([*accepted, own], near=solved.noise_scale)
            contenders.append(Contender(own, solved, solved.log_evidence - current.log_evidence))
        return sorted(contenders, key=self._order)

    def _order(self, one: Contender) -> float:
        """Least first: who is tried first; what is seen without any force goes before its equals."""
        lead = SEEN_STANDING_NATS if one.term.candidate.about.seen_standing else 0.0
        return -one.odds_gain(self.settings) - lead
