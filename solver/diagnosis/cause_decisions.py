"""What was decided of every cause that was proposed, kept for the answer, and what follows at the end."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import softmax

from solver.diagnosis.causes.effect import Candidate
from solver.diagnosis.checks import (
    CHECKS,
    DECIDED,
    NEEDED,
    PAYS,
    Decision,
    Verdict,
    about_the_suspect,
    decide,
    most_strain_asked,
    possible,
    strain_needed,
)
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.contenders import LEAST_UNKNOWN_NATS, TEMPER_NATS, Contender
from solver.diagnosis.search.proposed_causes import HeldOut, Key, OnReading, Proposal, Remainder
from solver.diagnosis.search.terms import Solved
from solver.fitting.diagnosis_settings import DiagnosisSettings

UNEXPLAINED_SCALE = 2.4  # model errors of sound recordings stay below it
# of confidence, with names of the same trace: what is likelier wrong than right is told as a tentative
# cause
LEAST_FOR_A_NAME = 0.5
OUTDONE = Decision(NEEDED, False, None, None, "a likelier set of causes was found without it")
SHORT_OF_EVIDENCE = (
    PAYS,
    DECIDED,
)  # checks that refuse a cause for too little, not for what speaks against it


def tenable(balance: Balance, contenders: Sequence[Contender], without: Solved) -> tuple[Contender, ...]:
    """Those that, large or small, may be what is wrong: possible, of a body of the entered mass, not refuted.

    Args:
        balance: of all trials.
        contenders: each beside the same others.
        without: these others alone.
    """
    proposals = [Proposal(balance, c, without) for c in contenders]
    return tuple(
        p.contender
        for p in proposals
        if possible(p).passed
        and about_the_suspect(p.keys, balance)
        and strain_needed(p) <= most_strain_asked(p)
    )


def is_unexplained(left: Contender | None, unknown: object | None, solved: Solved) -> bool:
    """Whether something is left: an unknown force, or a balance worse than any sound recording's.

    Args:
        left: a force of unknown time history beside the names.
        unknown: what is on no list, beside them or instead.
        solved: all names together.
    """
    return left is not None or unknown is not None or solved.noise_scale.scale > UNEXPLAINED_SCALE


def is_only_tentative(candidate: Candidate, in_its_class: float) -> bool:
    """Whether a name at the end is likelier wrong than right, whichever of its class it is.

    A foot that the motion shows to stand is more than the balance's guess.

    Args:
        candidate: that is named.
        in_its_class: how likely it is, with names that leave the same trace.
    """
    return not candidate.about.seen_standing and in_its_class < LEAST_FOR_A_NAME


@dataclass(frozen=True)
class CauseDecisions:
    """All that was asked of one cause, in the order of the checks."""

    id: str
    target: str
    named: bool
    odds_nats: float  # what it gained over its prior odds when it was last proposed
    decisions: tuple[Decision, ...]

    @property
    def fell_at(self) -> Decision | None:
        """The first check that it failed."""
        return next((d for d in self.decisions if not d.passed), None)


@dataclass(frozen=True)
class _Said:
    odds: float
    verdict: Verdict


class Trail:
    """Puts proposals to the checks and keeps what they said."""

    def __init__(self) -> None:
        self._accepted: dict[Key, _Said] = {}
        self._last: dict[Key, _Said] = {}
        self._since: dict[Key, dict[type[Proposal], Verdict]] = {}  # of causes that were accepted

    def put(self, proposal: Proposal) -> Verdict:
        """Ask all that is asked of such a proposal.

        Args:
            proposal: a cause beside others.
        """
        verdict = decide(proposal)
        for key in proposal.keys:
            if isinstance(proposal, HeldOut | OnReading | Remainder):
                self._last[key] = _Said(proposal.odds, verdict)
                self._since.pop(key, None)
                if verdict.fell_at is None:
                    self._accepted[key] = self._last[key]
            else:
                self._since.setdefault(key, {})[type(proposal)] = verdict
        return verdict

    def listed(self, named: Collection[Key]) -> tuple[CauseDecisions, ...]:
        """Of every cause that was proposed: named ones first, then those that gained most.

        Args:
            named: ids and targets of the causes in the answer.
        """
        found = [self._told(key, key in named) for key in self._last]
        return tuple(sorted(found, key=lambda c: (not c.named, -c.odds_nats)))

    def _told(self, key: Key, named: bool) -> CauseDecisions:
        said = self._accepted.get(key, self._last[key]) if named else self._last[key]
        verdicts = [said.verdict, *self._since.get(key, {}).values()]
        decisions = _in_order(verdicts)
        if not named and all(d.passed for d in decisions):
            decisions = _in_order([*verdicts, Verdict((OUTDONE,))])
        return CauseDecisions(*key, named, said.odds, decisions)


def _in_order(verdicts: list[Verdict]) -> tuple[Decision, ...]:
    """Of each check what was said last, refusals before all."""
    said: dict[str, Decision] = {}
    for decision in (d for verdict in verdicts for d in verdict.decisions):
        if decision.name not in said or said[decision.name].passed:
            said[decision.name] = decision
    return tuple(said[check.name] for check in CHECKS if check.name in said)


@dataclass(frozen=True)
class Chances:
    """Shares of one."""

    nothing: float
    on_the_list: float
    something_else: float


def compare_chances(
    refused: Sequence[CauseDecisions], unknown_nats: float, settings: DiagnosisSettings
) -> Chances:
    """By what the best of each kind gains: with just what is asked of it, it is as likely as nothing.

    Args:
        refused: causes that were proposed, each with its odds.
        unknown_nats: what the likeliest cause that is on no list, and large enough to be one, gains over its
            odds.
        settings: of the diagnosis.
    """
    fell = [(c.odds_nats, c.fell_at) for c in refused if c.fell_at is not None]
    short = [
        odds - _nats_asked(check, settings.least_gain)
        for odds, check in fell
        if check.name in SHORT_OF_EVIDENCE
    ]
    ahead = [0.0, max(short, default=-np.inf), unknown_nats - LEAST_UNKNOWN_NATS]
    nothing, listed, other = softmax(np.array(ahead) / TEMPER_NATS)
    return Chances(float(nothing), float(listed), float(other))


def _nats_asked(check: Decision, least_nats: float) -> float:
    """Nats that would have been enough: of two causes together more than of one."""
    return max(least_nats, check.limit) if check.name == PAYS and check.limit is not None else least_nats
