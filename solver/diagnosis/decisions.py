"""Every decision about a cause, in one ordered list: nothing else in the diagnosis accepts or refuses one.

The search, what reading undid, and unknown forces only make proposals (`proposals`). Each is put to the
checks that are asked of its kind, in the order of `CHECKS`; the first one that it fails refuses it. What
passes and what fails is kept for the answer with its figure, the limit, and the reason.
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

from solver.diagnosis.causes.effect import Candidate
from solver.diagnosis.checks import (
    BEATS_THE_UNKNOWN,
    DECIDED,
    DIRECT_CHECKED,
    HOLDS_UP,
    LEFT_OVER,
    NEEDED,
    NOTABLE,
    ON_THE_LIST,
    PAYS,
    POSSIBLE,
    STANDS_ALONE,
    Decision,
    about_the_suspect,
    beats_the_unknown,
    checked,
    decided,
    holds_up,
    is_on_the_list,
    left_over,
    most_strain_asked,
    needed,
    notable,
    pays,
    possible,
    stands_alone,
    strain_needed,
)
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.contenders import Contender
from solver.diagnosis.search.proposals import (
    Added,
    AgainstAnything,
    AllInPlace,
    BesideUnknown,
    HeldOut,
    Kept,
    Key,
    OnReading,
    Proposal,
    Remainder,
)
from solver.diagnosis.search.terms import Solved

UNEXPLAINED_SCALE = 2.4  # model errors of sound recordings stay below it
# of confidence, with names of the same trace: what is likelier wrong than right is told as a tentative
# cause
LEAST_FOR_A_NAME = 0.5
OUTDONE = Decision(NEEDED, False, None, None, "a likelier set of causes was found without it")


@dataclass(frozen=True, eq=False)
class Check:
    """A question, the kinds of proposals that it is put to, and who answers it."""

    name: str
    question: str
    asked_of: tuple[type[Proposal], ...]
    decide: Callable[[Proposal], Decision]


@dataclass(frozen=True)
class Verdict:
    """All that was asked of a proposal, up to the first refusal."""

    decisions: tuple[Decision, ...]

    @property
    def fell_at(self) -> str | None:
        """The first check that was failed; None where all were passed."""
        return next((d.name for d in self.decisions if not d.passed), None)

    @property
    def pays(self) -> bool:
        """Whether its evidence is enough, whatever else speaks against it."""
        return all(d.passed for d in self.decisions if d.name == PAYS)


def decide(proposal: Proposal) -> Verdict:
    """Ask what is asked of such a proposal; never less than whether it is possible and pays.

    Args:
        proposal: a cause beside others.
    """
    said: list[Decision] = []
    for check in CHECKS:
        if not isinstance(proposal, check.asked_of):
            continue
        if check.name not in (POSSIBLE, PAYS) and not all(d.passed for d in said):
            break
        said.append(check.decide(proposal))
    return Verdict(tuple(said))


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


def is_unexplained(left: Contender | None, told: object | None, solved: Solved) -> bool:
    """Whether something is left: an unknown force, or a balance worse than any sound recording's.

    Args:
        left: a force of unknown time history beside the names.
        told: what is on no list, beside them or instead.
        solved: all names together.
    """
    return left is not None or told is not None or solved.noise_scale.scale > UNEXPLAINED_SCALE


def is_only_tentative(candidate: Candidate, in_its_class: float) -> bool:
    """Whether a name at the end is likelier wrong than right, whichever of its class it is.

    A foot that the motion shows to stand is more than the balance's guess.

    Args:
        candidate: that is named.
        in_its_class: how likely it is, with names that leave the same trace.
    """
    return not candidate.about.seen_standing and in_its_class < LEAST_FOR_A_NAME


CHECKS: tuple[Check, ...] = (
    Check(
        DIRECT_CHECKED,
        "is it about the plate that files suspect, if they do, and does the person's weight allow for it?",
        (HeldOut,),
        checked,
    ),
    Check(POSSIBLE, "can there be such a thing?", (HeldOut,), possible),
    Check(PAYS, "does the balance gain enough by it?", (HeldOut, OnReading), pays),
    Check(HOLDS_UP, "does it predict blocks that its fit did not use?", (HeldOut,), holds_up),
    Check(
        STANDS_ALONE, "without another body mass, and without undoing the others?", (HeldOut,), stands_alone
    ),
    Check(
        BEATS_THE_UNKNOWN,
        "does a force of unknown time history do better in its place?",
        (BesideUnknown, AllInPlace),
        beats_the_unknown,
    ),
    Check(
        ON_THE_LIST,
        "does something that is on no list do better in its place?",
        (AgainstAnything,),
        is_on_the_list,
    ),
    Check(
        NOTABLE,
        "is it, and is all that stands beside it, large enough to act on?",
        (HeldOut, Kept, OnReading, BesideUnknown),
        notable,
    ),
    Check(NEEDED, "would the rest do without it?", (Kept,), needed),
    Check(DECIDED, "is it likelier than others in its place?", (Added,), decided),
    Check(LEFT_OVER, "does something remain that no cause explains?", (Remainder,), left_over),
)


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
