"""How much evidence a proposed cause must bring [nats], and why so much."""

from collections.abc import Sequence

from solver.diagnosis.causes.about import Weight
from solver.diagnosis.causes.effect import Candidate
from solver.diagnosis.search.contenders import Found
from solver.diagnosis.search.proposals import (
    Added,
    Exchanged,
    OnReading,
    Paired,
    Proposal,
)
from solver.fitting.diagnosis_settings import DiagnosisSettings


def least_first_gain(candidate: Candidate, scale: float, settings: DiagnosisSettings) -> float:
    """What a cause must gain if nothing else is known to be wrong [nats].

    Args:
        candidate: the cause.
        scale: of the model's errors beside it.
        settings: of the diagnosis.
    """
    least = settings.least_gain - dict(settings.never_imitated).get(candidate.id, candidate.less_at_first)
    return min(least, settings.quiet_least_gain) if scale <= settings.quiet_scale else least


def loose_ends(found: Sequence[Found], settings: DiagnosisSettings) -> float:
    """Gain left to what comes beside causes of any time history, which are never described whole [nats]."""
    return sum(
        (settings.step_rest_share if one.term.candidate.about.seen_standing else settings.rival_share)
        * max(0.0, one.gain)
        for one in (f.contender for f in found)
        if one.term.candidate.about.free
    )


def asked(p: Proposal) -> tuple[float, str]:
    """What a proposal must gain [nats], and why so much."""
    settings = p.settings
    match p:
        case Exchanged():
            own = p.instead_of.odds_gain(settings) + settings.exchange_margin
            return own, "to take the place of another cause it needs"
        case Paired():
            alone = max(c.odds_gain(settings) for c in (p.one, p.two))
            least = settings.least_gain + settings.least_further_gain
            further = settings.least_further_gain + loose_ends(p.others, settings)
            return max(least, alone + further, p.runner_up + settings.rival_margin), "two together need"
        case OnReading():
            return settings.least_gain, "what reading undid needs"
        case Added(others=others) if others:
            return settings.least_further_gain + loose_ends(others, settings), "a further cause needs"
    return least_first_gain(p.candidate, p.solved.noise_scale.scale, settings), "a first cause needs"


def may_lose(p: Proposal) -> float:
    """Of what lasts, and of masses, held-out blocks hardly tell [nats]."""
    if p.candidate.about.free:
        return 0.0
    share = (
        p.settings.mass_held_out_share
        if p.candidate.about.weight is Weight.MASS
        else p.settings.held_out_share
    )
    return share * p.contender.gain
