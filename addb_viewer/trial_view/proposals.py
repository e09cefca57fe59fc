"""What detection proposes for a trial, and what people made of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from jaxtyping import Bool

from addb_viewer.jobs.review_store import as_proposal
from annotations.events import AcceptProposal, Event, FlagRange, Proposal
from annotations.label_runs import true_runs
from annotations.open_proposals import open_proposals
from annotations.trial_review import TrialReview
from solver.contact.detected_ranges import Proposal as Detected


class State(StrEnum):
    """What became of a proposal."""

    OPEN = "open"
    ACCEPTED = "accepted"
    REJECTED = "rejected"


@dataclass(frozen=True)
class Pending:
    """A proposal and its state."""

    proposal: Proposal
    state: State


def pending(
    detected: Sequence[Detected], review: TrialReview, provenance: Mapping[str, str]
) -> tuple[Pending, ...]:
    """The proposals of a trial in order of time.

    One is open while a frame of it is undecided; else it is accepted where most of it does not count.

    Args:
        detected: by the solver.
        review: what people decided.
        provenance: of the fit that detection looked at.
    """
    ours = [d for d in detected if d.foot is None or d.foot in review.feet]
    known = [as_proposal(found, provenance) for found in ours]
    known.sort(key=lambda p: (p.start, p.end, p.foot or ""))
    waiting = {id(p) for p in open_proposals(known, review)}
    return tuple(Pending(p, State.OPEN if id(p) in waiting else _decided(p, review)) for p in known)


def as_proposed(flag: FlagRange, proposals: Sequence[Pending]) -> list[Event]:
    """Frames of a cause as decisions: what detection proposes there is accepted, the rest is flagged.

    Args:
        flag: the frames.
        proposals: of the trial; open ones of the same foot, mostly in these frames, are accepted.
    """
    rest, accepted = np.ones(flag.end - flag.start, dtype=bool), []
    for found in (p.proposal for p in proposals if p.state is State.OPEN and p.proposal.foot == flag.foot):
        start, end = max(0, found.start - flag.start), min(len(rest), found.end - flag.start)
        if 2 * (end - start) > found.end - found.start:
            rest[start:end] = False
            accepted.append(AcceptProposal(found))
    left = [replace(flag, start=flag.start + a, end=flag.start + b) for a, b in true_runs(rest)]
    return [*accepted, *left]


def still_open(proposals: Sequence[Pending], least: float = 0.0) -> int:
    """How many of at least that confidence nobody has decided."""
    return sum(p.state is State.OPEN and p.proposal.confidence >= least for p in proposals)


def _decided(proposal: Proposal, review: TrialReview) -> State:
    covered = sum(
        max(0, min(flag.end, proposal.end) - max(flag.start, proposal.start))
        for flag in review.flags
        if None in (flag.foot, proposal.foot) or flag.foot == proposal.foot
    )
    return State.ACCEPTED if 2 * covered >= proposal.end - proposal.start else State.REJECTED


def undecided_frames(
    left_out: Sequence[Proposal], review: TrialReview, frames: int
) -> list[tuple[int, int, str | None]]:
    """The frames and feet of these proposals about which nobody has decided: perhaps only a part of one.

    Args:
        left_out: proposals that a fit obeys.
        review: what people decided.
        frames: of the trial.
    """
    judged, found = review.judged(frames, by_files=True), []
    for p in left_out:
        lane = np.asarray(judged.all(axis=1) if p.foot is None else judged[:, review.feet.index(p.foot)])
        found += [(p.start + a, p.start + b, p.foot) for a, b in true_runs(~lane[p.start : p.end])]
    return found


def unsure_proposals(
    proposals: Sequence[Pending], review: TrialReview, frames: int, confidence: float
) -> tuple[Proposal, ...]:
    """Open proposals that detection does not leave out, and no imported review has decided.

    Args:
        proposals: of the trial.
        review: what people decided.
        frames: of the trial.
        confidence: from which on a proposal is left out.
    """
    judged: Bool[np.ndarray, " frames"] = np.all(review.judged(frames, by_files=True), axis=1)
    return tuple(
        p.proposal
        for p in proposals
        if p.state is State.OPEN
        and p.proposal.confidence < confidence
        and not judged[p.proposal.start : p.proposal.end].all()
    )
