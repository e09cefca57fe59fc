"""What is asked of a proposed cause, in one ordered list: nothing else accepts or refuses one.

The search, what reading undid, and unknown forces only make proposals (`proposals`). Each is put to the
checks that are asked of its kind, in the order of `CHECKS`; the first one that it fails refuses it. A check
answers with its figure, the limit, and the reason.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from solver.diagnosis.causes.about import Weight
from solver.diagnosis.causes.effect import Candidate
from solver.diagnosis.direct_checks.statement import REFUTING_NATS
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.contenders import (
    BESIDE_UNKNOWN_SHARE,
    EXCHANGE_NATS,
    LEAST_FURTHER_NATS,
    LEAST_UNKNOWN_NATS,
    RIVAL_NATS,
    RIVAL_SHARE,
    SAME_TRACE,
    Found,
    confidence,
    cosine,
    overlap,
)
from solver.diagnosis.search.proposed_causes import (
    Added,
    AgainstAnything,
    AllInPlace,
    BesideUnknown,
    Exchanged,
    HeldOut,
    Kept,
    Key,
    OnReading,
    Paired,
    Proposal,
    Remainder,
)
from solver.diagnosis.search.terms import Solved
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
MOST_MASS_STRAIN = 2.5  # standard deviations that a cause may need the body's mass from the entered one
# of log density of held-out blocks; a wrong mass gains little there, since the other blocks tell it even
# against the prior
LEAST_HELD_OUT_NATS = 0.0
# a cause so far ahead of all others stays even if it needs another mass: that may be wrong too
SURE_NATS = 100.0
OTHER_TRACE = 0.15  # cosine, up to which two causes explain different things and are no rivals
# cosine, turned round, of what a cause explains and what the others do: beyond it two large causes that are
# hardly there explain a small one that is not known
MOST_UNDONE = 0.7
MOST_BEHIND = 1.0  # T, by which what is on no list has to be ahead for a name to be given up
LEAST_LIFT_N = 20.0  # of a weight that no plate bears: with less, weighings say nothing
MORE_STRAIN = 1.0  # [prior deviations of the mass] a cause may ask for beyond what is wrong with it already

DIRECT_CHECKED, POSSIBLE, PAYS = "checked", "possible", "pays"
HOLDS_UP, STANDS_ALONE = "holds up", "stands alone"
BEATS_THE_UNKNOWN, ON_THE_LIST, NOTABLE, NEEDED = "beats the unknown", "on the list", "notable", "needed"
DECIDED, LEFT_OVER = "decided", "left over"


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


def gain_asked(p: Proposal) -> tuple[float, str]:
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


@dataclass(frozen=True)
class Decision:
    """What one check says of one cause."""

    name: str
    passed: bool
    nats: float | None  # what was found; None where the question is not one of evidence
    limit: float | None  # what was asked [nats]
    reason: str


def checked(p: Proposal) -> Decision:
    """Whether it is about the plates that direct checks suspect, if any, and the weight allows for it."""
    suspect = p.balance.suspect
    plates = " and ".join(sorted(suspect))
    if not about_the_suspect(p.keys, p.balance):
        reason = f"the files by themselves suspect {plates}: nothing else can be told before that"
        return Decision(DIRECT_CHECKED, False, None, None, reason)
    claimed, beside = _factors(p.solved), _factors(p.without)
    if claimed != beside:
        return _compare_weighings(p, claimed, beside)
    lifts, others = _lifts(p.solved, p.balance), _lifts(p.without, p.balance)
    if max(abs(lifts[trial] - others[trial]) for trial in lifts) > LEAST_LIFT_N:
        return _compare_lifts(p, lifts, others)
    reason = f"it is about {plates}, which the files suspect by themselves"
    return Decision(
        DIRECT_CHECKED, True, None, None, reason if suspect else "the files by themselves suspect no plate"
    )


def about_the_suspect(keys: Iterable[Key], balance: Balance) -> bool:
    """Whether one of these causes is about a plate that the files suspect; they may suspect none."""
    suspect = balance.suspect
    return not suspect or any(not suspect.isdisjoint(target.split("+")) for _, target in keys)


def _factors(solved: Solved) -> dict[str, float]:
    """By plate, how many times what is true it reads if all these causes are right."""
    factors: dict[str, float] = {}
    for term in solved.terms:
        for plate, factor in term.candidate.plate_factors().items():
            factors[plate] = factors.get(plate, 1.0) * factor
    return factors


def _compare_weighings(p: Proposal, claimed: dict[str, float], beside: dict[str, float]) -> Decision:
    """What the plates carry by themselves, if they read so many times what is true."""
    weighings = p.balance.weighings
    if not weighings.tell(claimed, beside):
        reason = "nobody entered a mass, and no other plate weighs the person: nothing tells units from that"
        return Decision(DIRECT_CHECKED, False, None, None, reason)
    nats = weighings.for_factors(claimed, beside)
    limit = max(0.0, weighings.of_another_plate(claimed, beside)) - REFUTING_NATS
    plates = [plate for plate in claimed if claimed[plate] != beside.get(plate)]
    with_it, without = (
        ", ".join(f"{mass:.0f}" for mass in weighings.masses_kg(plates, factors)) or "nothing"
        for factors in (claimed, beside)
    )
    reason = (
        f"by itself {' and '.join(plates)} carries {with_it} kg with it, {without} kg without; by what the "
        f"person weighs elsewhere that is {nats:+.1f} nats likelier; more than {limit:.0f} is asked, "
        "as other plates' units would do so much"
    )
    return Decision(DIRECT_CHECKED, nats > limit, nats, limit, reason)


def _compare_lifts(p: Proposal, lifts_N: dict[str, float], others_N: dict[str, float]) -> Decision:
    """What the plates carry while they bear all, if something else bears so much."""
    mass_kg = p.balance.scenes[0].skeleton.mass * (p.balance.scenes[0].scale_factor or 1.0)
    nats, limit = p.balance.weighings.for_lifts(lifts_N, others_N, mass_kg), -REFUTING_NATS
    carried = ", ".join(f"{w.mass_kg({}):.0f}" for w in p.balance.weighings.weighings) or "nothing"
    reason = (
        f"while they bear all, plates carry {carried} kg of a body of {mass_kg:.0f} kg; that is {nats:+.1f} "
        f"nats likelier with {max(lifts_N.values()):.0f} N lifted, and more than {limit:.0f} is asked"
    )
    return Decision(DIRECT_CHECKED, nats > limit, nats, limit, reason)


def _lifts(solved: Solved, balance: Balance) -> dict[str, float]:
    """Weight by trial that no plate bears, all through it, if all these causes are right [N]."""
    lifts = {scene.name: 0.0 for scene in balance.scenes}
    for k, term in enumerate(solved.terms):
        estimates = solved.estimates(k, balance.scenes)
        for trial in lifts:
            lifts[trial] += term.candidate.lifted_N(trial, estimates)
    return lifts


def possible(p: Proposal) -> Decision:
    """Whether there can be such a thing."""
    passed = p.candidate.is_possible(p.estimates())
    return Decision(POSSIBLE, passed, None, None, "" if passed else "of this size there is no such thing")


def pays(p: Proposal) -> Decision:
    """Whether the balance gains enough by it."""
    limit, whose = gain_asked(p)
    passed = p.odds >= limit
    return Decision(
        PAYS, passed, p.odds, limit, f"it gains {p.odds:.1f} nats over its odds; {whose} {limit:.1f}"
    )


def holds_up(p: Proposal) -> Decision:
    """Whether it predicts blocks that its fit did not use."""
    assert isinstance(p, HeldOut)
    limit = LEAST_HELD_OUT_NATS - (0.0 if isinstance(p, Paired) else may_lose(p))
    nats = p.held_out.best + (0.0 if isinstance(p, Paired) else p.candidate.seen_elsewhere)
    reason = f"on held-out blocks it gains {nats:.1f} nats; more than {limit:.1f} is asked"
    return Decision(HOLDS_UP, nats > limit, nats, limit, reason)


def stands_alone(p: Proposal) -> Decision:
    """Whether it needs no other body mass, and does not undo the others."""
    strain, most = strain_needed(p), most_strain_asked(p)
    if strain > most and not (isinstance(p, Added) and _tentative(p)):
        reason = f"it needs a body {strain:.1f} deviations from the entered mass; {most:.1f} at most"
        return Decision(STANDS_ALONE, False, None, None, reason)
    if sum(term.candidate.about.is_a_clock for term in p.solved.terms) > 1:
        return Decision(STANDS_ALONE, False, None, None, "the same forces have another clock already")
    undone = 0.0 if isinstance(p, Paired) else _undone(p.solved)
    if undone > MOST_UNDONE:
        reason = f"it mostly takes back what the others explain (cosine −{undone:.2f})"
        return Decision(STANDS_ALONE, False, None, None, reason)
    reason = f"the body's mass stays within {strain:.1f} deviations" + (
        ", and nothing else comes near" if strain > most else ""
    )
    return Decision(STANDS_ALONE, True, None, None, reason)


def strain_needed(p: Proposal) -> float:
    """Standard deviations by which the set with it needs the body's mass from the entered one."""
    return abs(p.balance.mass_strain(p.solved))


def most_strain_asked(p: Proposal) -> float:
    """What it may need: more where the mass is wrong already.

    Without it, the mass is judged at the same scale: a cause that sharpens the balance shows what was
    wrong with the mass already.
    """
    same_scale = p.balance.solve_at(p.without.terms, p.solved.noise_scale)
    return max(MOST_MASS_STRAIN, abs(p.balance.mass_strain(same_scale)) + MORE_STRAIN)


def _tentative(p: Added) -> bool:
    """Whether nothing else comes near: then it stays, even if the mass is wrong as well."""
    others = [c.odds_gain(p.settings) for c in p.tenable if c is not p.contender]
    return p.odds - max(others, default=0.0) > SURE_NATS


def _undone(solved: Solved) -> float:
    """Cosine, turned round, of what the last cause explains and what the others do."""
    *others, last = (solved.explained(k, solved.noise_scale) for k in range(len(solved.terms)))
    return -cosine(last, np.sum(others, axis=0)) if others else 0.0


def beats_the_unknown(p: Proposal) -> Decision:
    """Whether a force of unknown time history does worse in its place."""
    if isinstance(p, AllInPlace):
        return _all_beat_the_unknown(p)
    assert isinstance(p, BesideUnknown)
    if p.candidate.about.seen_standing:
        return Decision(BEATS_THE_UNKNOWN, True, None, None, "the motion shows it as well")
    least = LEAST_FURTHER_NATS + BESIDE_UNKNOWN_SHARE * max(0.0, p.left.gain)
    ahead = -np.inf if p.beyond is None else p.beyond - p.solved.log_evidence
    passed = not (p.loss <= least and ahead > p.margin)
    reason = (
        f"beside a force of unknown time history it adds {p.loss:.1f} nats; {least:.1f} are asked where that "
    )
    return Decision(
        BEATS_THE_UNKNOWN, passed, p.loss, least, f"{reason}force does better in its place by {p.margin:.1f}"
    )


def _all_beat_the_unknown(p: AllInPlace) -> Decision:
    if any(f.contender.term.candidate.about.seen_standing for f in p.found):
        return Decision(BEATS_THE_UNKNOWN, True, None, None, "the motion shows one of the causes as well")
    alone = p.alone()
    if alone is None:
        return Decision(
            BEATS_THE_UNKNOWN, True, None, None, "no force of unknown time history would do instead"
        )
    lead = p.solved.log_evidence - alone.solved.log_evidence
    reason = (
        f"all causes are {lead:+.1f} nats ahead of a force of unknown time history; {-p.margin:.1f} is asked"
    )
    return Decision(BEATS_THE_UNKNOWN, lead >= -p.margin, lead, -p.margin, reason)


def is_on_the_list(p: Proposal) -> Decision:
    """Whether nothing that is on no list does better in its place."""
    assert isinstance(p, AgainstAnything)
    lead = -p.behind * p.temper
    reason = (
        f"it is {lead:+.1f} nats ahead of whatever else may be wrong ({p.instead}); {-p.temper:.1f} is asked"
    )
    return Decision(ON_THE_LIST, p.behind < MOST_BEHIND, lead, -p.temper, reason)


def notable(p: Proposal) -> Decision:
    """Whether it, and all that stands beside it, is large enough to act on."""
    small = [
        solved.terms[k].candidate
        for solved, k in p.fits
        if not solved.terms[k].candidate.is_notable(solved.estimates(k, p.balance.scenes))
    ]
    names = ", ".join(dict.fromkeys(f"{c.id} {c.target}" for c in small))
    reason = f"too small to act on: {names}" if small else "large enough to act on"
    return Decision(NOTABLE, not small, None, None, reason)


def needed(p: Proposal) -> Decision:
    """Whether the rest would not do without it."""
    nats, limit = p.odds, p.settings.least_gain
    if len(p.solved.terms) == 1:
        return Decision(NEEDED, True, nats, None, "it is the only cause")
    reason = f"without it the rest loses {nats:.1f} nats over its odds; {limit:.1f} is asked"
    return Decision(NEEDED, nats >= limit, nats, limit, reason)


def decided(p: Proposal) -> Decision:
    """Whether it is likelier than a handful of others in its place, or certain; else the model's own errors.

    Causes that leave the same trace are one class, told together: that a recording cannot tell mass from mass
    makes neither less likely. Nor does a cause that leaves another trace altogether.
    """
    assert isinstance(p, Added)
    settings = p.settings
    if p.odds >= settings.certain_gain:
        reason = "certain, whatever else would do"
        return Decision(DECIDED, True, p.odds, settings.certain_gain, reason)
    unlike = [r for r in p.tenable if OTHER_TRACE < overlap(p.contender, r) < SAME_TRACE]
    share = confidence(p.contender, unlike, settings)
    reason = (
        f"among {len(unlike)} others in its place that leave another trace it has {100 * share:.0f} %; "
        f"{100 * settings.least_confidence:.0f} % is asked"
    )
    return Decision(DECIDED, share >= settings.least_confidence, None, None, reason)


def left_over(p: Proposal) -> Decision:
    """Whether something remains that no cause explains."""
    assert isinstance(p, Remainder)
    limit = LEAST_UNKNOWN_NATS + loose_ends(p.others)
    nats, size = p.contender.gain, f"{p.size_N:.0f} N"
    passed = nats > limit and p.size_N > p.least_N
    reason = f"a force of unknown time history of {size} (from {p.least_N:.0f} N on) gains {nats:.1f} nats"
    return Decision(LEFT_OVER, passed, nats, limit, f"{reason}; more than {limit:.1f} is asked")


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
        STANDS_ALONE, "without another body mass or clock, or undoing the others?", (HeldOut,), stands_alone
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
