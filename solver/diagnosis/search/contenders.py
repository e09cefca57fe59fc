"""Candidates fitted beside other causes, and how they compare: odds, confidence, likeness."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.diagnosis.causes.effect import Candidate
from solver.diagnosis.search.terms import Solved, Term
from solver.fitting.diagnosis_settings import DiagnosisSettings

# of every cause after the first, which has the rest of the first to explain as well
LEAST_FURTHER_NATS = 10.0
EXCHANGE_NATS = 2.0  # by which another cause must do better beside all others to take a place
LEAST_UNKNOWN_NATS = 15.0  # of a force of any time history, which is free to follow noise
LEAST_UNKNOWN_SHARE = 0.012  # [BW] a force below it nobody would look for
# of what a free time history explains, that a cause named beside it must add: it is never whole
BESIDE_UNKNOWN_SHARE = 0.1
RIVAL_NATS = 4.0  # of log evidence, within which two causes are not told apart
RIVAL_SHARE = 0.03  # of the gain, likewise: what the model gets wrong grows with what a cause explains
MOST_TOLD_NATS = 50.0  # of a finding without the balance: surer is nobody
TEMPER_NATS = 3.0  # evidence is overconfident where the model is wrong
SAME_TRACE = 0.9  # cosine of what two causes explain, from which on they are told as one class


@dataclass(frozen=True, eq=False)
class Contender:
    """A candidate fitted beside other causes."""

    term: Term
    solved: Solved
    gain: float  # log evidence beyond those

    @property
    def nbytes(self) -> int:
        """That its rows take."""
        return self.term.columns.nbytes

    def odds_gain(self, settings: DiagnosisSettings) -> float:
        """The gain less the log prior odds against the cause [nats]."""
        return self.gain - handicap(self.term.candidate, settings)


@dataclass(frozen=True, eq=False)
class Found:
    """A cause beside all others that were found, and what else might be in its place."""

    contender: Contender
    held_out_gain: float  # log density of held-out blocks beyond the causes found before
    rivals: tuple[Contender, ...]  # others that were tried in its place, best first


def handicap(candidate: Candidate, settings: DiagnosisSettings) -> float:
    """Log odds against the cause before the balance [nats]; a cause seen elsewhere is no imitation."""
    elsewhere = candidate.seen_elsewhere
    usual = dict(settings.handicaps).get(candidate.id, candidate.about.odds_against) + candidate.place_odds
    return -elsewhere if elsewhere > 0 else usual - elsewhere


def confidence(one: Contender, rivals: Sequence[Contender], settings: DiagnosisSettings) -> float:
    """Share of a cause among none and all that were tried in its place, on tempered log evidence and odds.

    Args:
        one: the cause.
        rivals: all of them.
        settings: of the diagnosis.
    """
    others = [c.odds_gain(settings) for c in rivals if c.term.candidate.key != one.term.candidate.key]
    gains = np.array([0.0, *others]) - one.odds_gain(settings)
    return float(1 / (1 + np.exp(np.clip(gains / TEMPER_NATS, -50, 50)).sum()))


def overlap(one: Contender, other: Contender) -> float:
    """Absolute cosine between what two causes explain, whitened where the first fits best."""
    own, others = (c.solved.explained(_place(c), one.solved.noise_scale) for c in (one, other))
    return abs(cosine(own, others))


def explain_the_same(one: Contender, other: Contender) -> bool:
    """Whether what two causes explain differs by no more than noise makes it differ.

    Half the squared difference, whitened [nats], is what a recording of either says against the other; of
    noise in two more parameters it is below 3 nineteen times in twenty.
    """
    difference = one.solved.noise_scale.whiten(one.solved.all_taken() - other.solved.all_taken())
    return float(difference @ difference) / 2 < TEMPER_NATS


def _place(one: Contender) -> int:
    """Of the candidate among all that were fitted together."""
    return next(k for k, term in enumerate(one.solved.terms) if term is one.term)


def cosine(one: Float[np.ndarray, " rows"], other: Float[np.ndarray, " rows"]) -> float:
    lengths = np.linalg.norm(one) * np.linalg.norm(other)
    return float(one @ other / max(lengths, np.finfo(float).tiny))
