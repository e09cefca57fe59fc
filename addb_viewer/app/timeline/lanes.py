"""The lanes of the timeline: who stands where, which forces do not count, what is proposed and decided."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from addb_viewer.app.style.palette import BLUE, CAUSE, GREEN, GREY, ORANGE, Rgb, foot_color, reason_color
from addb_viewer.app.trial.forces_in_use import mask_now
from addb_viewer.app.trial.proposals import Pending, State
from addb_viewer.app.trial.replay import Replay
from addb_viewer.diagnosis_vocabulary import ranges_of, title
from annotations.events import Status
from annotations.foot_names import foot_letter
from annotations.reasons import key_of, reason_words
from annotations.suggested_activity import SuggestedActivity
from annotations.trial_review import TrialReview
from annotations.wording import sure_words
from solver.contact.wrenches import DETECTION, RECORDING
from solver.kinematics.label_faults.fault import EXCHANGED, LabelFault
from solver.runs import runs

_NO_FORCE = "the recording has no force for the foot here"
_UNDECIDED = "left out by detection, not decided by anybody yet"


@dataclass(frozen=True)
class Block:
    """Frames start to end − 1 of a lane."""

    start: int
    end: int
    text: str  # on it, where there is room
    told: str  # when pointed at
    color: Rgb
    hatched: bool = False  # not measured, or not decided by a person
    height: float = 1.0  # share of the lane's
    outlined: bool = False  # the one that keys act on


@dataclass(frozen=True)
class Lane:
    """One row."""

    label: str
    blocks: tuple[Block, ...]


def lanes_of(
    replay: Replay,
    review: TrialReview,
    *,
    reviewed: Sequence[tuple[int, int]],
    proposals: Sequence[Pending],
    current: Pending | None,
    figures: Mapping[str, Any] | None,
    suggested: Sequence[SuggestedActivity] = (),
    chosen: tuple[int, int] | None = None,
) -> tuple[Lane, ...]:
    """All lanes of a trial.

    Args:
        replay: the trial.
        review: what people decided.
        reviewed: ranges that somebody has looked at.
        proposals: what detection thinks, and what became of it.
        current: the proposal that keys act on.
        figures: of a diagnosis in the shape of `diagnose --json`; None where nobody asked.
        suggested: activities that wait for a person.
        chosen: the selected range.
    """
    feet = review.feet
    lanes = [Lane(f"contact {foot_letter(foot)}", _contacts(replay, i)) for i, foot in enumerate(feet)]
    lanes += [Lane(f"missing {foot_letter(foot)}", _missing(replay, review, foot)) for foot in feet]
    lanes.append(Lane("proposed", tuple(_proposal(p, p is current) for p in proposals)))
    activities = tuple(
        Block(
            a.start,
            a.end,
            a.subclass or a.activity,
            f"{a.activity}{f', {a.subclass}' if a.subclass else ''} ({a.author})",
            BLUE,
        )
        for a in review.activities
    )
    waiting = tuple(_suggestion(s, (s.start, s.end) == chosen) for s in suggested)
    lanes.append(Lane("activity", (*activities, *waiting)))
    lanes.append(Lane("reviewed", tuple(Block(a, b, "", "looked at", GREEN) for a, b in reviewed)))
    if replay.label_faults:
        lanes.append(Lane("labels", tuple(_label_fault(fault) for fault in replay.label_faults)))
    lanes.append(Lane("causes", () if figures is None else _causes(figures, replay.name)))
    return tuple(lanes)


def reviewed_ranges(review: TrialReview, frames: int) -> tuple[tuple[int, int], ...]:
    """Ranges on which a person has decided about every foot; all frames of a finished trial."""
    if review.status is Status.FINISHED:
        return ((0, frames),)
    return tuple((int(start), int(end)) for start, end in runs(np.asarray(review.judged(frames).any(axis=1))))


def _contacts(replay: Replay, foot: int) -> tuple[Block, ...]:
    color = foot_color(replay.feet[foot], foot) if foot < len(replay.feet) else GREY
    return tuple(
        Block(
            phase.start,
            phase.end,
            "" if phase.is_measured else "?",
            f"on the ground; a plate carries {100 * phase.loaded:.0f} % of it",
            color,
            hatched=not phase.is_measured,
        )
        for phase in replay.forces.contacts
        if phase.foot == foot
    )


def _missing(replay: Replay, review: TrialReview, foot: str) -> tuple[Block, ...]:
    """What the next solve leaves out: of the recording's own, by detection, by files, by people."""
    flags = (*review.flags, *(review.stays_out or ()))
    mask = mask_now(replay, review)
    told = [
        Block(
            flag.start,
            flag.end,
            key_of(flag.reason),
            ": ".join(filter(None, (reason_words(flag.reason), flag.author, flag.source, flag.note))),
            reason_color(flag.reason),
            hatched=flag.source in ("imported", "undecided proposal"),
        )
        for flag in flags
        if flag.foot in (None, foot)
    ]
    if mask is None:
        return tuple(told)
    known = {RECORDING: _NO_FORCE}
    if review.stays_out is None:
        known[DETECTION] = _UNDECIDED
    others = [
        Block(
            start,
            end,
            key_of(reason),
            f"{reason_words(reason)}: {known[source]}",
            reason_color(reason),
            hatched=True,
        )
        for (start, end, of_foot, reason), source in zip(mask.reasons, mask.sources, strict=True)
        if of_foot in (None, foot) and source in known
    ]
    return (*others, *told)


def _proposal(pending: Pending, current: bool) -> Block:
    p = pending.proposal
    signs = {State.OPEN: "?", State.ACCEPTED: "✓", State.REJECTED: "✗"}
    foot = "all feet" if p.foot is None else foot_letter(p.foot)
    return Block(
        p.start,
        p.end,
        f"{signs[pending.state]}{key_of(p.reason)}",
        f"{reason_words(p.reason)}, {foot}, {sure_words(p.confidence)} sure; {pending.state}",
        ORANGE if pending.state is State.OPEN else GREY,
        hatched=pending.state is State.REJECTED,
        height=0.35 + 0.65 * p.confidence,
        outlined=current,
    )


def _suggestion(suggested: SuggestedActivity, at_hand: bool) -> Block:
    return Block(
        suggested.start,
        suggested.end,
        f"{suggested.label}?",
        f"{suggested.label}: suggested, {sure_words(suggested.confidence)} sure; nobody has said so",
        BLUE,
        hatched=True,
        height=0.35 + 0.65 * suggested.confidence,
        outlined=at_hand,
    )


def _label_fault(fault: LabelFault) -> Block:
    exchanged = fault.done == EXCHANGED
    sign = " ⇄ ".join(fault.labels) if exchanged else f"{fault.labels[0]} left out"
    return Block(fault.start, fault.end, sign, fault.note, CAUSE, hatched=not exchanged, height=0.8)


def _causes(figures: Mapping[str, Any], trial: str) -> tuple[Block, ...]:
    return tuple(
        Block(start, end, title(effect), title(effect), CAUSE, height=0.8)
        for effect in figures["effects"]
        for name, start, end in ranges_of(figures, effect)
        if name == trial
    )
