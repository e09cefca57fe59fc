"""What was decided of every cause that was proposed, for the answer."""

from collections.abc import Collection
from dataclasses import dataclass

from solver.diagnosis.checks import NEEDED, Decision
from solver.diagnosis.decisions import CHECKS, Verdict, decide
from solver.diagnosis.search.proposals import HeldOut, Key, OnReading, Proposal, Remainder

OUTDONE = Decision(NEEDED, False, None, None, "a likelier set of causes was found without it")


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

    def told(self, named: Collection[Key]) -> tuple[CauseDecisions, ...]:
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
