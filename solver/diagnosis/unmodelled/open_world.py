"""How sure a name is when the truth may be on no list: names against whatever else may be in their place.

The catalogue is never complete. Each unknown cause stands for everything of a kind that might be wrong, known
or not, told as what it touches: columns of the balance with a wide Gaussian prior and nothing else. Their
freedom costs them evidence, so that a right name of few parameters wins, and the nearest wrong one does not.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.special import logsumexp

from solver.common.plate_figures import HALF_SIDE_M
from solver.diagnosis.cause_decisions import Trail
from solver.diagnosis.causes.about import About
from solver.diagnosis.causes.clocks import MOST_TRIALS
from solver.diagnosis.causes.contact_windows import contact_windows
from solver.diagnosis.causes.effect import Estimate, Eta, Fitted, InPieces, InTrials, Range, Signature
from solver.diagnosis.causes.observed_trial import Scene, force_at
from solver.diagnosis.causes.plate_readings import required_of
from solver.diagnosis.causes.time_history import Stretch
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.contenders import (
    BESIDE_UNKNOWN_SHARE,
    LEAST_FURTHER_NATS,
    LEAST_UNKNOWN_NATS,
    LEAST_UNKNOWN_SHARE,
    SAME_TRACE,
    TEMPER_NATS,
    Contender,
    Found,
    explain_the_same,
    handicap,
    overlap,
)
from solver.diagnosis.search.proposed_causes import AgainstAnything
from solver.diagnosis.search.terms import Solved, Term
from solver.diagnosis.unmodelled.remainder import force_columns, moment_columns, time_histories_of
from solver.diagnosis.unmodelled.unexplained import CLIMBED, Kept
from solver.fitting.diagnosis_settings import DiagnosisSettings

SIZES = (0.01, 0.05, 0.2, 0.8)  # of body weight, or of what a plate bears: standard deviations
SIZE_SHARES = (0.4, 0.3, 0.2, 0.1)  # how likely each is before the data
LEVER_M = 0.3  # of an unknown moment about the centre of mass
TIME_HISTORY_KNOTS_S = 0.5  # of what lasts
EVENT_KNOTS_S = 0.06  # of what happens once
LONGEST_EVENT_S = 1.5  # a longer one is a time history
MOST_EVENTS = 3  # of one trial, the strongest
CLOCK_S = 0.1  # of which the sizes are shares: 1 to 80 ms
LEAST_LOADED = 10  # frames on which a plate has to be loaded

OUTSIDE_THE_LIST = "outside_the_list"
BODY, EVENT, PLATE, TIME = "body", "event", "plate", "time"  # what it touches
# of what a name explains, by which evidence is tempered more. On a draw of edited recordings right names
# need 0.02 at most (a harness, while somebody stands), and a name that was rightly given up 0.11; other
# draws judge (benchmarks/FAULTS.md)
TEMPER_SHARE = 0.03
FORCES = (BODY, EVENT)
LARGEST_CLASS = 3  # of names, as many as anybody can look into


@dataclass(frozen=True)
class Outside(InTrials):
    """Something that no entry of the catalogue is; its one η is its size."""

    about = About(OUTSIDE_THE_LIST)
    kind = BODY

    @property
    def words(self) -> str:
        """What it touches, where it stands beside a figure."""
        where = f" in {self.trial}" if self.trial else ""
        return {
            PLATE: f"{self.target}{where}",
            TIME: f"the time of {self.target}",
            EVENT: f"a moment{where}",
        }.get(self.kind, f"a force on the body{where}")

    def starts(self, scenes: Sequence[Scene]) -> tuple[Eta, ...]:
        """Every size."""
        return tuple((size,) for size in SIZES)

    def estimates(self, scenes: Sequence[Scene], fit: Fitted) -> dict[str, Estimate]:
        """Root mean square of the force that it adds, where it acts [N]."""
        force = np.concatenate([self._force(s, fit.x) for s in self.own(scenes)])
        return {"rms_force_N": Estimate(float(np.sqrt((force**2).sum(axis=1).mean())), 0.0)}

    def _force(self, scene: Scene, x: Float[np.ndarray, " parameters"]) -> Float[np.ndarray, "some 3"]:
        force, acts, first = np.zeros((scene.frames, 3)), np.zeros(scene.frames, dtype=bool), 0
        for piece in self.pieces(scene, (SIZES[0],)):
            force += piece.columns[:, :3] @ x[first : first + len(piece.prior_std)]
            acts |= piece.columns.any(axis=(1, 2))
            first += len(piece.prior_std)
        return force[acts]

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """Always: it competes, whatever its size."""
        return True


@dataclass(frozen=True)
class AnyWrench(Outside, InPieces):
    """A wrench about the centre of mass: steady, or of a time history that changes within half a second."""

    knots_s: float | None = None  # None: steady

    about = About(OUTSIDE_THE_LIST, sentence="Something acts on the body that is on no list.")

    def pieces(self, scene: Scene, eta: Eta) -> Iterator[Signature]:
        """Forces at the centre of mass and moments."""
        if scene.name == self.trial:
            steady = np.ones((scene.frames, 1))
            time_histories = steady if self.knots_s is None else time_histories_of(scene, self.knots_s)
            yield from _wrench_of_any(scene, time_histories, eta[0])


@dataclass(frozen=True)
class AnyEvent(Outside, InPieces):
    """A wrench of any time history that lasts a short while."""

    stretch: Stretch | None = None

    kind = EVENT
    about = About(OUTSIDE_THE_LIST, sentence="Something acts for a moment that is on no list.")

    def pieces(self, scene: Scene, eta: Eta) -> Iterator[Signature]:
        """Likewise, within its stretch."""
        if self.stretch is not None and scene.name == self.trial:
            yield from _wrench_of_any(scene, self.stretch.humps(EVENT_KNOTS_S), eta[0])

    def frames(
        self, scenes: Sequence[Scene], eta: Eta, x: Float[np.ndarray, " parameters"]
    ) -> tuple[Range, ...]:
        """Its stretch."""
        assert self.stretch is not None
        return (Range(self.stretch.trial, self.stretch.start, self.stretch.end),)


@dataclass(frozen=True)
class AnyPlateFault(Outside):
    """Whatever is wrong with one plate: while it is loaded a steady wrench, and any linear map of its load.

    The map acts on what the motion demands of the plate, never on what was recorded: that has the noise of
    the balance in it.
    """

    kind = PLATE
    about = About(OUTSIDE_THE_LIST, sentence="Something is wrong with {target} that is on no list.")

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """About the plate's centre, then about the ground origin."""
        plate = scene.loaded_plate(self.target)
        if plate is None or not self.own((scene,)) or plate.loaded.sum() < LEAST_LOADED:
            return None
        load = required_of(plate, scene)
        centre = np.broadcast_to(plate.centre_ground, (scene.frames, 3))
        load = (
            load - force_at(load[:, :3], centre) + np.pad(load[:, :3], ((0, 0), (0, 3)))
        )  # about the centre
        on = plate.loaded.astype(float)
        size, weight = eta[0], scene.weight_N
        unit = np.array([1.0, 1.0, 1.0, HALF_SIDE_M, HALF_SIDE_M, HALF_SIDE_M])
        columns, std = [], []
        for i in range(6):
            steady = np.zeros((scene.frames, 6))
            steady[:, i] = on
            columns.append(steady)
            std.append(size * weight * unit[i])
            for j in range(6):
                mapped = np.zeros((scene.frames, 6))
                mapped[:, i] = on * load[:, j]
                columns.append(mapped)
                std.append(size * unit[i] / unit[j])
        about_centre = np.stack(columns, axis=2)
        force = about_centre[:, :3].transpose(0, 2, 1)
        about_origin = force_at(force, np.broadcast_to(plate.centre_ground, force.shape)).transpose(0, 2, 1)
        about_origin[:, 3:] += about_centre[:, 3:]
        return Signature(about_origin, np.array(std))


@dataclass(frozen=True)
class AnyClock(Outside):
    """A trial's plates, or one of them, a little late or early."""

    kind = TIME
    about = About(OUTSIDE_THE_LIST, sentence="The time of {target} is off in a way that is on no list.")

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """How fast the recorded wrench changes [N/s, N·m/s]."""
        if scene.name != self.trial:
            return None
        recorded = scene.measured_ground
        if self.target != self.trial:
            plate = scene.loaded_plate(self.target.split(" in ")[0])
            if plate is None:
                return None
            recorded = plate.wrench_ground
        return Signature(
            np.gradient(recorded, 1 / scene.rate, axis=0)[:, :, None], np.array([eta[0] * CLOCK_S])
        )


def outside_the_list(scenes: Sequence[Scene]) -> list[Outside]:
    """One family a trial: a steady wrench, one that changes, events; every plate; clocks that differ."""
    found: list[Outside] = []
    several = len(scenes) > 1
    for scene in scenes:
        found.append(AnyWrench("", scene.name))
        found.append(AnyWrench("", scene.name, TIME_HISTORY_KNOTS_S))
        short = [w.stretch for w in contact_windows(scene) if w.stretch.seconds <= LONGEST_EVENT_S]
        found += [AnyEvent("", scene.name, stretch) for stretch in short[:MOST_EVENTS]]
        if len(scenes) > MOST_TRIALS:  # clocks of a few have names
            found.append(AnyClock(scene.name, scene.name))
        loaded = [p.target for p in scene.plates if p.loaded.sum() >= LEAST_LOADED]
        if several and len(loaded) > 1:  # so has a plate's in all of them
            found += [AnyClock(f"{target} in {scene.name}", scene.name) for target in loaded]
        if several:
            found += [AnyPlateFault(target, scene.name) for target in loaded]
    plates = dict.fromkeys(p.target for s in scenes for p in s.plates if p.loaded.sum() >= LEAST_LOADED)
    found += [AnyPlateFault(target) for target in plates]
    return found


def _wrench_of_any(
    scene: Scene, time_histories: Float[np.ndarray, "frames time histories"], size: float
) -> Iterator[Signature]:
    prior_std = np.full(time_histories.shape[1], size * scene.weight_N)
    for axis in range(3):
        yield Signature(force_columns(scene.com_ground, time_histories, axis), prior_std)
    for axis in range(3):
        yield Signature(moment_columns(time_histories, axis, LEVER_M), prior_std)


@dataclass(frozen=True, eq=False)
class Unknown:
    """One unknown cause beside some names, its size integrated out."""

    cause: Outside
    log_evidence: float
    likeliest: Solved  # at the size of most evidence; the unknown is the last of its terms

    def size_N(self, scenes: Sequence[Scene]) -> float:
        """Root mean square of its force [N]."""
        return self.likeliest.estimates(len(self.likeliest.terms) - 1, scenes)["rms_force_N"].value


class OpenWorld:
    """The unknown causes of a balance; their rows are made once."""

    def __init__(self, balance: Balance) -> None:
        self.balance = balance
        self._terms = [
            (cause, terms)
            for cause in outside_the_list(balance.scenes)
            if (terms := _of_each_size(balance, cause))
        ]

    def beside(self, rest: Sequence[Term], near: Solved) -> list[Unknown]:
        """Each unknown cause beside these names; the likeliest few at their own scales, best first.

        Args:
            rest: names that stay.
            near: whose scales the others are judged at.
        """
        there = [self._at(cause, terms, rest, near) for cause, terms in self._terms]
        there.sort(key=lambda u: -u.log_evidence)
        climbed = [self._climb(u) for u in there[:CLIMBED]]
        return sorted([*climbed, *there[CLIMBED:]], key=lambda u: -u.log_evidence)

    def _at(self, cause: Outside, terms: Sequence[Term], rest: Sequence[Term], near: Solved) -> Unknown:
        each = [self.balance.solve_at([*rest, term], near.noise_scale) for term in terms]
        return Unknown(cause, _integrate(each), max(each, key=lambda s: s.log_evidence))

    def _climb(self, unknown: Unknown) -> Unknown:
        best = unknown.likeliest
        there = self.balance.solve(best.terms, near=best.noise_scale)
        return Unknown(unknown.cause, unknown.log_evidence + there.log_evidence - best.log_evidence, there)


@dataclass(frozen=True, eq=False)
class Rival:
    """Another cause that was tried in a name's place."""

    contender: Contender
    share: float
    temper: float  # T against the name [nats]


@dataclass(frozen=True, eq=False)
class Standing:
    """A name among everything that may be in its place."""

    confidence: float
    in_its_class: float  # its share, and those of the likeliest few that leave the same trace
    outside: float  # share of all that is on no list
    behind: float  # by how many T it is ahead of the name
    temper: float  # T [nats]
    strongest: Unknown | None  # of these
    rivals: tuple[Rival, ...] = ()


@dataclass(frozen=True, eq=False)
class Held:
    """The names that hold against whatever is on no list, and what of that stands beside them or instead."""

    solved: Solved
    found: tuple[Found, ...]
    standings: tuple[Standing, ...]  # of each name that was found
    unknown: Unknown | None
    unknown_nats: float = -np.inf  # what the likeliest one that is large enough gains, stated or not


def hold_names(balance: Balance, kept: Kept, names: int, trail: Trail) -> Held:
    """Names given up, the least likely first, as long as one is likelier something that is on no list.

    Args:
        balance: of all trials.
        kept: names, each with what else was tried in its place.
        names: in the catalogue, over which the odds for a known cause are spread.
        trail: puts the question and keeps the answers.
    """
    world, solved, found = OpenWorld(balance), kept.solved, list(kept.found)
    while True:
        beside = world.beside(solved.terms, solved)
        standings = [_standing(world, one, solved, beside, names) for one in found]
        fallen = [
            k
            for k, (one, s) in enumerate(zip(found, standings, strict=True))
            if trail.put(_proposal(balance, one, solved, s)).fell_at is not None
        ]
        if not fallen:
            break
        given_up = found.pop(max(fallen, key=lambda k: standings[k].behind)).contender.term
        solved = balance.solve([t for t in solved.terms if t is not given_up], near=solved.noise_scale)
    unknown, gain = _find_unknown(world, solved, beside, names)
    return Held(solved, tuple(found), tuple(standings), unknown, gain)


def _proposal(balance: Balance, one: Found, solved: Solved, standing: Standing) -> AgainstAnything:
    contender = Contender(one.contender.term, solved, one.contender.gain)
    instead = "nothing" if standing.strongest is None else standing.strongest.cause.words
    return AgainstAnything(balance, contender, solved, standing.behind, standing.temper, instead)


def _standing(
    world: OpenWorld, one: Found, solved: Solved, beside: Sequence[Unknown], names: int
) -> Standing:
    """Shares of a name, its rivals, nothing, and the unknown: p ∝ exp((log evidence + log prior odds) / T).

    T grows with what the name explains, as what evidence gets wrong does: of 200 nats for a load, 11 more
    than for another mass do not make it certain. But it speaks for neither of two that explain the same: one
    clock for all trials, and one for each, all found alike. What is unknown counts as one: each alone at that
    T, many that explain little would outweigh a name; and the name's own odds do not count against it, since
    what imitates it on sound recordings is off the list as well. Where something unknown is there besides,
    the name may stand beside that, if it pays there. What is seen outside the balance, nothing in its place
    explains: there it may stand beside any of them, for its rarity. Where a foot is seen to stand somewhere,
    the ground carries it: a force of another place and time history is none in its place.
    """
    balance, settings = world.balance, world.balance.settings
    candidate = one.contender.term.candidate
    rest = [t for t in solved.terms if t is not one.contender.term]
    without = balance.solve(rest, near=solved.noise_scale)
    gain = solved.log_evidence - without.log_evidence
    against = handicap(candidate, settings)
    moved = gain - one.contender.gain  # since the rivals were tried
    others = [r for r in one.rivals if r.term.candidate.key != candidate.key]
    rivals = [r.odds_gain(settings) + moved for r in others]
    every = world.beside(rest, solved)
    odds = _log_odds(settings, names, len(every))
    unknown = [u for u in every if not (candidate.about.seen_standing and u.cause.kind in FORCES)]
    temper = TEMPER_NATS + TEMPER_SHARE * max(0.0, gain)
    together = logsumexp([u.log_evidence for u in unknown]) if unknown else -np.inf
    off_the_list = together - without.log_evidence + odds
    among, own = gain - against, gain
    if against < 0:
        also = np.array([*rivals, off_the_list]) + min(gain, 0.0) - against - candidate.about.odds_against
        among = own = temper * logsumexp(np.array([gain - against, *also]) / temper)
    elif beside:
        more = beside[0].log_evidence - solved.log_evidence + odds
        own += max(0.0, more - LEAST_FURTHER_NATS - BESIDE_UNKNOWN_SHARE * max(0.0, more))
    same = [explain_the_same(one.contender, other) for other in others]
    tempers = np.where([False, *same], TEMPER_NATS, temper)  # against nothing, and each
    listed = (np.array([0.0, *rivals]) - among) / tempers
    off = (off_the_list - own) / temper
    total = logsumexp([0.0, *listed, off])
    alike = sorted(
        share
        for share, other in zip(listed[1:], others, strict=True)
        if overlap(one.contender, other) > SAME_TRACE
    )[1 - LARGEST_CLASS :]
    return Standing(
        confidence=float(np.exp(-total)),
        in_its_class=float(np.exp(logsumexp([0.0, *alike]) - total)),
        outside=float(np.exp(off - total)),
        behind=float(off),
        temper=temper,
        strongest=unknown[0] if unknown else None,
        rivals=tuple(
            Rival(other, float(share), float(T))
            for other, share, T in zip(others, np.exp(listed[1:] - total), tempers[1:], strict=True)
        ),
    )


def _find_unknown(
    world: OpenWorld, solved: Solved, unknown: Sequence[Unknown], names: int
) -> tuple[Unknown | None, float]:
    """The likeliest unknown beside the names, if it is certain and large enough to look for.

    Returns:
        That, and what the likeliest of all that are large enough gains: a small one is no fault to look for.
    """
    settings = world.balance.settings
    odds = _log_odds(settings, names, len(unknown))
    least_N = LEAST_UNKNOWN_SHARE * world.balance.scenes[0].weight_N
    large = next((one for one in unknown if one.size_N(world.balance.scenes) >= least_N), None)
    if large is None:
        return None, -np.inf
    gain = large.log_evidence - solved.log_evidence + odds
    explained = max(0.0, solved.log_evidence - world.balance.solve([], near=solved.noise_scale).log_evidence)
    least = LEAST_UNKNOWN_NATS + BESIDE_UNKNOWN_SHARE * explained
    return (large if large is unknown[0] and gain >= least else None), gain


def _log_odds(settings: DiagnosisSettings, names: int, unknown: int) -> float:
    """Of one unknown cause against one name, before the data: both shares are spread evenly."""
    if names == 0:
        return -np.inf
    outside = settings.outside_odds
    return float(np.log(outside / (1 - outside) * names / max(1, unknown)))


def _integrate(each: Sequence[Solved]) -> float:
    """Log evidence over all sizes."""
    return float(logsumexp([s.log_evidence for s in each], b=SIZE_SHARES))


def _of_each_size(balance: Balance, cause: Outside) -> list[Term]:
    """The same columns under another prior each: they are whitened once."""
    first = balance.term(cause, (SIZES[0],))
    if first is None:
        return []
    return [
        first,
        *(replace(first, eta=(size,), prior_std=first.prior_std * size / SIZES[0]) for size in SIZES[1:]),
    ]
