"""Which short trial would tell the likeliest causes apart, and by how much.

Each hypothesis (a name, a rival in its place, nothing, something on no list) was fitted to the present
trials: it has a posterior of its parameters, and of all that a sound recording may be off by. With a short
trial's columns that predicts the trial's balance as a Gaussian. What the trial will say for hypothesis a
against b, if a is right, is expected to be

    D(a, b) = ½ [tr(V_b⁻¹ V_a) − n + (m_a − m_b)ᵀ V_b⁻¹ (m_a − m_b) + log det V_b − log det V_a]    nats

where those of the proposal are told with b at the noise scale that then suits it best.
The best trial is most likely to leave the right one a share of nine tenths, whichever of them is right. Nats
are tempered as in the diagnosis of all trials, the more the more is explained, and scatter by √(2 D).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.special import logit, softmax
from scipy.stats import norm

from solver.diagnosis.deciding.predicted_trial import (
    Hypothesis,
    Posterior,
    nats_between,
    posteriors,
    present_of,
    rows_of_trial,
)
from solver.diagnosis.deciding.short_trials import ShortTrial, can_move, short_trials
from solver.diagnosis.diagnosis import ToBeSure
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.contenders import TEMPER_NATS, Found
from solver.diagnosis.search.terms import Solved
from solver.diagnosis.unmodelled.open_world import OUTSIDE_THE_LIST, TEMPER_SHARE, Held, Standing

SURE = 0.9  # of a name: nothing more needs to be recorded
LEAST_SHARE = 0.03  # of a hypothesis, to be heard
LEAST_NATS = 2.0  # that a trial has to promise against a rival, or for it
LEAST_CHANCE = 0.05  # that the right one is sure then, likewise
LEAST_COUNTED = 1e-6  # of a share
MOST_RIVALS = 3
NOTHING = "nothing"


def trial_to_be_sure(balance: Balance, held: Held) -> ToBeSure | None:
    """The short trial that is most likely to decide the least sure name that has a rival; None where all are.

    Args:
        balance: of all trials.
        held: the names, each among all that may be in its place.
    """
    unsure = [(one, s) for one, s in zip(held.found, held.standings, strict=True) if s.confidence < SURE]
    if not unsure or not can_move(present_of(balance)):
        return None
    one, standing = max(unsure, key=lambda pair: pair[1].confidence)
    some = hypotheses(balance, held.solved, one, standing)
    fitted = posteriors(balance, some)
    asked = best_of(expected(balance, fitted), some)
    return asked if asked is None else in_full(balance, fitted, asked)


def hypotheses(balance: Balance, solved: Solved, one: Found, standing: Standing) -> list[Hypothesis]:
    """The name, then all that may be in its place, the likeliest first.

    Args:
        balance: of all trials.
        solved: all names together.
        one: the name.
        standing: its share, and those of all else.
    """
    rest = [t for t in solved.terms if t is not one.contender.term]
    near = solved.noise_scale
    others = [
        Hypothesis(
            *(term := r.contender.term).candidate.key,
            r.share,
            r.temper,
            balance.solve_at([*rest, term], near),
        )
        for r in standing.rivals
        if r.share >= LEAST_SHARE
    ]
    if standing.strongest is not None and standing.outside >= LEAST_SHARE:
        unknown = standing.strongest
        terms = [*rest, unknown.likeliest.terms[-1]]
        words, share = unknown.cause.words, standing.outside
        with_it = balance.solve_at(terms, near)
        others.append(Hypothesis(OUTSIDE_THE_LIST, words, share, standing.temper, with_it))
    known = standing.confidence + standing.outside + sum(r.share for r in standing.rivals)
    without = balance.solve_at(rest, near)
    others.append(Hypothesis(NOTHING, "", max(0.0, 1.0 - known), standing.temper, without))
    name, there = one.contender.term.candidate.key, balance.solve_at(solved.terms, near)
    own = Hypothesis(*name, standing.confidence, TEMPER_NATS, there)
    likeliest = sorted(others, key=lambda h: -h.share)
    return [own, *(h for k, h in enumerate(likeliest) if k < MOST_RIVALS or h.id == NOTHING)]


@dataclass(frozen=True, eq=False)
class Expected:
    """What a short trial promises: nats for each hypothesis against each other, and their shares then."""

    trial: ShortTrial
    nats: Float[np.ndarray, "right other"]
    shares: Float[np.ndarray, "right other"]  # afterwards, if the first is right
    sure: Float[np.ndarray, " right"]  # chance of a share of `SURE` then

    def chance(self, some: Sequence[Hypothesis]) -> float:
        """That the right one is sure afterwards."""
        return float(np.array([h.share for h in some]) @ self.sure)

    def share(self, some: Sequence[Hypothesis]) -> float:
        """Of the right one afterwards, averaged over which it is."""
        before = np.array([h.share for h in some])
        return float(before @ np.diag(self.shares) / before.sum())


def expected(balance: Balance, fitted: Sequence[Posterior]) -> list[Expected]:
    """What each short trial promises at least, by some of its windows; the best first.

    Args:
        balance: of all trials.
        fitted: hypotheses.
    """
    some = [p.of for p in fitted]
    about = [t for h in some for t in h.target.split("+")]
    found = [_expected(balance, fitted, trial) for trial in short_trials(present_of(balance), about)]
    return sorted((e for e in found if e is not None), key=lambda e: -e.chance(some))


def in_full(balance: Balance, fitted: Sequence[Posterior], asked: ToBeSure) -> ToBeSure:
    """A proposal with the nats and odds of all windows of its trial; arguments as in `expected`."""
    if asked.trial is None:
        return asked
    key = asked.other_id, asked.other_target
    rival = next(p for p in fitted if (p.of.id, p.of.target) == key)
    few = [fitted[0], rival, *(p for p in fitted if p.of.id == NOTHING and p is not rival)]
    trials = short_trials(present_of(balance), asked.plates)
    trial = next(t for t in trials if (t.kind.id, t.plates) == (asked.trial, asked.plates))
    whole = _expected(balance, few, trial, in_full=True)
    if whole is None:
        return asked
    odds = float(whole.shares[0, 0] / max(whole.shares[0, 1], LEAST_COUNTED))
    nats, if_other = float(whole.nats[0, 1]), float(whole.nats[1, 0])
    return replace(asked, nats=nats, nats_if_other=if_other, odds_after=odds)


def _expected(
    balance: Balance, fitted: Sequence[Posterior], trial: ShortTrial, *, in_full: bool = False
) -> Expected | None:
    rows = rows_of_trial(balance, trial, present_of(balance), in_full=in_full)
    if rows is None:
        return None
    nats = nats_between(balance, rows, fitted, at_own_scales=in_full)
    some = [p.of for p in fitted]
    shares = shares_after(some, nats)
    return Expected(trial, nats, shares, chance_of_sure(shares, nats, _tempers(some, nats)))


def shares_after(
    some: Sequence[Hypothesis], nats: Float[np.ndarray, "right other"]
) -> Float[np.ndarray, "right other"]:
    """Of each hypothesis, if one of them is right: evidence counts less the more is explained by it.

    Args:
        some: hypotheses, the name first.
        nats: that a trial says for the first against the second.
    """
    log_shares = np.log(np.maximum([h.share for h in some], LEAST_COUNTED))
    evidence = np.array([h.temper for h in some]) * (log_shares - log_shares[0])
    odds = (evidence - evidence[:, None] - nats) / _tempers(some, nats)
    left_out = max(0.0, 1.0 - sum(h.share for h in some))  # fares as well as the one that fares best
    others = np.where(np.eye(len(some)) > 0, np.inf, nats / _tempers(some, nats)).min(axis=1)
    rest = np.log(max(left_out, LEAST_COUNTED)) - log_shares - others
    return softmax(np.column_stack([odds, rest]), axis=1)[:, :-1]


def _tempers(
    some: Sequence[Hypothesis], nats: Float[np.ndarray, "right other"]
) -> Float[np.ndarray, "right other"]:
    """Nats that count as one afterwards; arguments as in `shares_after`."""
    tempers = np.array([h.temper for h in some])
    nothing = [k for k, h in enumerate(some) if h.id == NOTHING]
    more = [TEMPER_SHARE * max(0.0, float(own[nothing].sum())) for own in nats]
    return np.asarray(np.maximum.outer(tempers, tempers) + np.array(more)[:, None])


def chance_of_sure(
    shares: Float[np.ndarray, "right other"],
    nats: Float[np.ndarray, "right other"],
    tempers: Float[np.ndarray, "right other"],
) -> Float[np.ndarray, " right"]:
    """That each hypothesis, if it is right, has a share of `SURE`: nats against its likeliest rival scatter.

    Args:
        shares: afterwards, as expected.
        nats: that are expected.
        tempers: nats that count as one.
    """
    right = np.arange(len(shares))
    own = np.clip(np.diag(shares), LEAST_COUNTED, 1 - LEAST_COUNTED)
    rival = np.where(np.eye(len(shares)) > 0, -1.0, shares).argmax(axis=1)
    scatter = np.sqrt(2 * np.maximum(nats[right, rival], LEAST_COUNTED)) / tempers[right, rival]
    return np.asarray(norm.cdf((logit(own) - logit(SURE)) / scatter))


def best_of(promised: Sequence[Expected], some: Sequence[Hypothesis]) -> ToBeSure | None:
    """The one to propose, its figures to come: none where nothing on the list helps; None without a rival.

    Args:
        promised: the best first.
        some: hypotheses, the name first and its strongest rival next.
    """
    name, rivals = some[0], [k for k, h in enumerate(some) if k and h.share >= LEAST_SHARE]
    if not rivals:
        return None
    best, told = None, rivals[0]
    if promised and promised[0].chance(some) >= LEAST_CHANCE:
        nats = promised[0].nats
        parted = [k for k in rivals if max(nats[0, k], nats[k, 0]) >= LEAST_NATS]
        best, told = (promised[0], parted[0]) if parted else (None, told)
    rival = some[told]
    asked = ToBeSure(name.id, name.target, rival.id, rival.target, name.share / rival.share)
    if best is None:
        return asked
    return replace(
        asked,
        trial=best.trial.kind.id,
        plates=best.trial.plates,
        words=best.trial.words,
        share_after=best.share(some),
    )
