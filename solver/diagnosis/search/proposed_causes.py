"""What is put before the checks: a cause of a set, the set without it, and what was tried in its place."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Int

from solver.diagnosis.causes.effect import Candidate, Estimate
from solver.diagnosis.held_out_gain import HeldOutGain, held_out_gain
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.contenders import Contender, Found, handicap
from solver.diagnosis.search.terms import Solved
from solver.fitting.diagnosis_settings import DiagnosisSettings

Key = tuple[str, str]


@dataclass(frozen=True, eq=False)
class Proposal:
    """A cause fitted beside others: its term is among those of `contender.solved`."""

    balance: Balance
    contender: Contender
    without: Solved  # the others, without it

    @property
    def settings(self) -> DiagnosisSettings:
        """Of the diagnosis."""
        return self.balance.settings

    @property
    def candidate(self) -> Candidate:
        """The cause in question."""
        return self.contender.term.candidate

    @property
    def solved(self) -> Solved:
        """The set with it."""
        return self.contender.solved

    @property
    def keys(self) -> tuple[Key, ...]:
        """Names that the answer is about."""
        return (self.candidate.key,)

    @property
    def odds(self) -> float:
        """Log evidence that it adds, less the log prior odds against it [nats]."""
        return self.contender.odds_gain(self.settings)

    @property
    def place(self) -> int:
        """Of its term in the set."""
        return next(k for k, t in enumerate(self.solved.terms) if t is self.contender.term)

    @property
    def fits(self) -> tuple[tuple[Solved, int], ...]:
        """Fits, and terms in them, whose sizes somebody would have to act on."""
        return ((self.solved, self.place),)

    def estimates(self) -> dict[str, Estimate]:
        """The catalogue's parameters of the cause."""
        return self.solved.estimates(self.place, self.balance.scenes)


@dataclass(frozen=True, eq=False)
class HeldOut(Proposal):
    """A cause that has to predict blocks which its fit has not seen."""

    blocks: Sequence[Int[np.ndarray, " rows"]]

    @cached_property
    def held_out(self) -> HeldOutGain:
        """What it gains on them [nats]."""
        return held_out_gain(self.balance, self.blocks, self.without, self.solved)


@dataclass(frozen=True, eq=False)
class Added(HeldOut):
    """A further cause, or the first one."""

    others: tuple[Found, ...]  # found before
    tenable: tuple[Contender, ...]  # what may be wrong instead, itself included


@dataclass(frozen=True, eq=False)
class Exchanged(HeldOut):
    """A cause in the place of another one."""

    instead_of: Contender

    @property
    def fits(self) -> tuple[tuple[Solved, int], ...]:
        """Its own, and those beside which it stands."""
        return tuple((self.solved, k) for k in range(len(self.solved.terms)))


@dataclass(frozen=True, eq=False)
class Paired(HeldOut):
    """Two causes of which neither stands out alone; `contender` is the second, with what both add."""

    others: tuple[Found, ...]
    one: Contender  # as they were alone
    two: Contender
    runner_up: float  # odds of the next best two [nats]

    @property
    def keys(self) -> tuple[Key, ...]:
        """Of both."""
        return self.one.term.candidate.key, self.two.term.candidate.key

    @property
    def odds(self) -> float:
        """Of both together."""
        against = sum(handicap(c.term.candidate, self.settings) for c in (self.one, self.two))
        return self.contender.gain - against

    @property
    def fits(self) -> tuple[tuple[Solved, int], ...]:
        """Both."""
        last = len(self.solved.terms) - 1
        return (self.solved, last - 1), (self.solved, last)


@dataclass(frozen=True, eq=False)
class Kept(Proposal):
    """A cause found before, once later ones are there."""


@dataclass(frozen=True, eq=False)
class OnReading(Proposal):
    """A cause that reading the files undid, with the evidence that leaving it in would cost."""


@dataclass(frozen=True, eq=False)
class BesideUnknown(Proposal):
    """A named cause beside a force of unknown time history, which may as well be in its place."""

    left: Contender  # the unknown beside all named causes
    in_its_place: Callable[[], Contender | None]  # the unknown without this one
    margin: float  # by which the unknown has to be ahead [nats]

    @cached_property
    def beyond(self) -> float | None:
        """Log evidence with the unknown in its place; None where none pays there."""
        other = self.in_its_place()
        return None if other is None else other.solved.log_evidence

    @property
    def loss(self) -> float:
        """What it adds beside the unknown, less the log prior odds against it [nats]."""
        beyond = self.without.log_evidence if self.beyond is None else self.beyond
        return self.left.solved.log_evidence - beyond - handicap(self.candidate, self.settings)

    @property
    def fits(self) -> tuple[tuple[Solved, int], ...]:
        """Its own, without the unknown and beside it; none of what the motion shows as well."""
        if self.candidate.about.seen_standing:
            return ()
        return (self.solved, self.place), (self.left.solved, self.place)


@dataclass(frozen=True, eq=False)
class AllInPlace(Proposal):
    """All named causes together against a force of unknown time history alone."""

    found: tuple[Found, ...]
    alone: Callable[[], Contender | None]
    margin: float  # by which the unknown has to be ahead [nats]

    @property
    def keys(self) -> tuple[Key, ...]:
        """Of all."""
        return tuple(f.contender.term.candidate.key for f in self.found)


@dataclass(frozen=True, eq=False)
class AgainstAnything(Proposal):
    """A named cause, and what is likeliest in its place of all that is on no list."""

    behind: float  # by how many T that is ahead of the name
    temper: float  # T [nats]
    instead: str  # in words


@dataclass(frozen=True, eq=False)
class Remainder(Proposal):
    """What no named cause explains: a force or a moment of unknown time history beside them."""

    others: tuple[Found, ...]
    size_N: float
    least_N: float
