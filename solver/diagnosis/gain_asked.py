"""How much evidence a proposed cause must bring [nats], and why so much."""

from collections.abc import Sequence

from solver.diagnosis.causes.about import Weight
from solver.diagnosis.causes.effect import Candidate
from solver.diagnosis.search.contenders import (
    EXCHANGE_NATS,
    LEAST_FURTHER_NATS,
    RIVAL_NATS,
    RIVAL_SHARE,
    Found,
)
from solver.diagnosis.search.proposals import (
    Added,
    Exchanged,
    OnReading,
    Paired,
    Proposal,
)
from solver.fitting.diagnosis_settings import DiagnosisSettings

QUIET_SCALE = 0.125  # of the model's errors, up to which there is next to nothing to imitate a cause
# asked of a first cause there: in 40 clean recordings so quiet none gained 2, while in sound real ones with
# more model error some gain 7
QUIET_LEAST_NATS = 5.0
# of its gain, that a cause without its own time history may lose on held-out blocks: the others predict a
# plate's place without it, at the price of an unlikely body
HELD_OUT_SHARE = 0.05
MASS_HELD_OUT_SHARE = 0.4  # likewise of a mass, which follows the other blocks anyway
# of the gain of a step beside the plates, that later causes must gain beyond the rest: its force and its
# place are free, while a contact has one point and leaves `rival_share`
STEP_REST_SHARE = 0.02


def least_first_gain(candidate: Candidate, scale: float, settings: DiagnosisSettings) -> float:
    """What a cause must gain if nothing else is known to be wrong [nats].

    Args:
        candidate: the cause.
        scale: of the model's errors beside it.
        settings: of the diagnosis.
    """
    least = settings.least_gain - candidate.less_at_first
    return min(least, QUIET_LEAST_NATS) if scale <= QUIET_SCALE else least


def loose_ends(found: Sequence[Found]) -> float:
    """Gain left to what comes beside causes of any time history, which are never described whole [nats]."""
    return sum(
        (STEP_REST_SHARE if one.term.candidate.about.seen_standing else RIVAL_SHARE) * max(0.0, one.gain)
        for one in (f.contender for f in found)
        if one.term.candidate.about.free
    )


def asked(p: Proposal) -> tuple[float, str]:
    """What a proposal must gain [nats], and why so much."""
    settings = p.settings
    match p:
        case Exchanged():
            own = p.instead_of.odds_gain(settings) + EXCHANGE_NATS
            return own, "to take the place of another cause it needs"
        case Paired():
            alone = max(c.odds_gain(settings) for c in (p.one, p.two))
            least = settings.least_gain + LEAST_FURTHER_NATS
            further = LEAST_FURTHER_NATS + loose_ends(p.others)
            return max(least, alone + further, p.runner_up + RIVAL_NATS), "two together need"
        case OnReading():
            return settings.least_gain, "what reading undid needs"
        case Added(others=others) if others:
            return LEAST_FURTHER_NATS + loose_ends(others), "a further cause needs"
    return least_first_gain(p.candidate, p.solved.noise_scale.scale, settings), "a first cause needs"


def may_lose(p: Proposal) -> float:
    """Of what lasts, and of masses, held-out blocks hardly tell [nats]."""
    if p.candidate.about.free:
        return 0.0
    share = MASS_HELD_OUT_SHARE if p.candidate.about.weight is Weight.MASS else HELD_OUT_SHARE
    return share * p.contender.gain
