"""What no cause of the catalogue explains: sought beside the named causes, and they beside it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from solver.diagnosis.cause_decisions import Trail
from solver.diagnosis.causes.effect import Eta
from solver.diagnosis.checks import decide
from solver.diagnosis.noise.noise_scales import NoiseScale
from solver.diagnosis.search.balance import Balance
from solver.diagnosis.search.contenders import LEAST_UNKNOWN_SHARE, Contender, Found
from solver.diagnosis.search.proposed_causes import AllInPlace, BesideUnknown, Remainder
from solver.diagnosis.search.selection import Selection
from solver.diagnosis.search.terms import Solved, Term
from solver.diagnosis.unmodelled.remainder import Unknown, constant_share
from solver.diagnosis.unmodelled.unknown_screen import Tried, UnknownSearch

UNKNOWN_MARGIN_NATS = 12.0  # by which a force of any time history must beat named causes
UNKNOWN_SHARE = 0.1  # of what named causes explain, likewise: a free time history follows model errors
# of a free time history's mean square; with more in its mean it never changes, takes no named cause's place
# and is told beside one only if it explains something else: forces that the catalogue lacks had 0.87 at
# most, what imitates a tilt or a mass 0.98
MOST_CONSTANT = 0.95
MOMENT_LEVER_M = 0.1  # by which a moment counts as a force
CLIMBED = 3  # unknown causes, to the scale that suits each
RESEMBLING = 0.5  # cosine, from which on a steady force is the named causes in other words


@dataclass(frozen=True, eq=False)
class Kept:
    """Named causes that pay beside what is left, and that."""

    solved: Solved
    found: tuple[Found, ...]
    left: Contender | None


def keep_beside_the_unknown(balance: Balance, selection: Selection) -> Kept:
    """Which causes stay named once a force or moment of unknown time history may take their place.

    Args:
        balance: of all trials.
        selection: causes found in it.
    """
    solved, found = selection.solved, selection.found
    unknown = UnknownSearch(balance)
    left = _left_beside(unknown, solved, found)
    if not found:
        return Kept(solved, found, left)
    explained = max(0.0, solved.log_evidence - selection.null.log_evidence)
    margin = UNKNOWN_MARGIN_NATS + UNKNOWN_SHARE * explained
    if left is not None:
        return _without_needless(unknown, Kept(solved, found, left), margin, selection.trail)
    whole = Contender(found[0].contender.term, solved, explained)
    proposal = AllInPlace(
        balance, whole, selection.null, found, lambda: _in_their_place(unknown, selection.null, ()), margin
    )
    if selection.trail.put(proposal).fell_at is None:
        return Kept(solved, found, None)
    return Kept(selection.null, (), _left_beside(unknown, selection.null, ()))


def _without_needless(unknown: UnknownSearch, kept: Kept, margin: float, trail: Trail) -> Kept:
    """Causes dropped, one after another, in whose place a force of unknown time history does better."""
    solved, found, left = kept.solved, kept.found, kept.left
    while found and left is not None:
        proposals = [
            _beside_the_unknown(unknown, Kept(solved, found, left), k, margin) for k in range(len(found))
        ]
        weak = [k for k, one in enumerate(proposals) if trail.put(one).fell_at is not None]
        if not weak:
            break
        k = min(weak, key=lambda k: proposals[k].loss)
        solved, found = proposals[k].without, found[:k] + found[k + 1 :]
        left = _left_beside(unknown, solved, found)
    return Kept(solved, found, left)


def _beside_the_unknown(unknown: UnknownSearch, kept: Kept, k: int, margin: float) -> BesideUnknown:
    """The k-th named cause, and what would be in its place."""
    assert kept.left is not None
    term, others = kept.found[k].contender.term, kept.found[:k] + kept.found[k + 1 :]
    rest = [t for t in kept.solved.terms if t is not term]
    without = unknown.balance.solve(rest, near=kept.solved.noise_scale)
    contender = Contender(term, kept.solved, kept.solved.log_evidence - without.log_evidence)
    return BesideUnknown(
        unknown.balance,
        contender,
        without,
        kept.left,
        lambda: _in_their_place(unknown, without, others),
        margin,
    )


def _left_beside(unknown: UnknownSearch, solved: Solved, found: Sequence[Found]) -> Contender | None:
    """What is left beside named causes; if it stays the same all along, only what none of them explains."""
    parts = [part for term in solved.terms for part in term.whiten(solved.noise_scale) if part is not None]
    columns = [np.zeros((len(solved.left), 0)), *(part.reshape(len(part), -1) for part in parts)]
    basis = np.linalg.qr(np.concatenate(columns, axis=1))[0]

    def resembles(one: Tried) -> bool:
        """Whether the named causes, of any sizes, come near what it explains."""
        own = solved.noise_scale.whiten(unknown.balance.basis.transform(unknown.screen.explained(one)))
        share = np.linalg.norm(basis.T @ own) / max(np.linalg.norm(own), np.finfo(float).tiny)
        return bool(share > RESEMBLING)

    return _left(unknown, solved, found, resembles)


def _in_their_place(unknown: UnknownSearch, solved: Solved, found: Sequence[Found]) -> Contender | None:
    """What would explain most in the place of a cause; never what stays the same all along.

    Supports, tilts, biases and masses are in the catalogue, and a steady force that is free to act anywhere
    imitates them all.
    """
    return _left(unknown, solved, found, lambda one: True)


def _left(
    unknown: UnknownSearch,
    solved: Solved,
    found: Sequence[Found],
    excluded_if_steady: Callable[[Tried], bool],
) -> Contender | None:
    """The force of unknown time history, or the moment, that would explain most; None where none pays."""
    balance = unknown.balance
    terms: dict[tuple[Unknown, Eta], Term] = {}  # one may be tried from several noise scales
    climbed = []
    for sought in unknown.likeliest(solved):
        one = sought.tried
        steady = constant_share(unknown.screen.time_history_ground(one)) > MOST_CONSTANT
        if steady and excluded_if_steady(one):
            continue
        term = terms.get((one.candidate, one.eta)) or balance.term(one.candidate, one.eta)
        assert term is not None
        terms[one.candidate, one.eta] = term
        both = _beside(balance, solved, term, sought.noise_scale)
        climbed.append((both.gain - one.candidate.reach_cost(balance.scenes), both))
        if len(climbed) == CLIMBED:
            break
    if not climbed:
        return None
    best = max(climbed, key=lambda c: c[0])[1]
    least_N = LEAST_UNKNOWN_SHARE * balance.scenes[0].weight_N
    size = size_N(balance, best)
    proposal = Remainder(balance, best, solved, tuple(found), size, least_N)
    return best if decide(proposal).fell_at is None else None


def size_N(balance: Balance, left: Contender) -> float:
    """RMS of an unknown force; of a moment, that of a force on a lever of a tenth of a metre."""
    estimates = left.solved.estimates(len(left.solved.terms) - 1, balance.scenes)
    if "rms_force_N" in estimates:
        return estimates["rms_force_N"].value
    return estimates["rms_moment_Nm"].value / MOMENT_LEVER_M


def _beside(balance: Balance, solved: Solved, term: Term, noise_scale: NoiseScale) -> Contender:
    """A term beside the named causes, at the scale that suits them together."""
    both = balance.solve([*solved.terms, term], near=noise_scale)
    return Contender(term, both, both.log_evidence - solved.log_evidence)


def position(solved: Solved, term: Term) -> int:
    """Of a term among those that were fitted together."""
    return next(k for k, t in enumerate(solved.terms) if t is term)
