"""How likely nothing is wrong where nothing is named, against a cause of the catalogue and anything else."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import softmax

from solver.diagnosis.checks import DECIDED, PAYS, Decision
from solver.diagnosis.decisions import CauseDecisions
from solver.diagnosis.search.contenders import LEAST_UNKNOWN_NATS, TEMPER_NATS
from solver.fitting.diagnosis_settings import DiagnosisSettings

SHORT_OF_EVIDENCE = (
    PAYS,
    DECIDED,
)  # checks that refuse a cause for too little, not for what speaks against it


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
