"""The lanes of the timeline: who stands where, which forces do not count, what is proposed and decided."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from addb_viewer.text.diagnosis_vocabulary import short_title
from addb_viewer.trial_view.disagreements import conflict_words
from addb_viewer.trial_view.forces_in_use import mask_now
from addb_viewer.trial_view.palette import (
    BLUE,
    CAUSE,
    COUNTS,
    GREY,
    REVIEWED,
    VERMILION,
    Rgb,
    foot_color,
    reason_color,
)
from addb_viewer.trial_view.proposals import Pending, State
from addb_viewer.trial_view.replay import Replay
from annotations.events import Status
from annotations.foot_names import foot_letter, foot_words
from annotations.reasons import key_of, reason_words
from annotations.suggested_activity import SuggestedActivity
from annotations.trial_review import TrialReview
from annotations.wording import sure_words
from solver.common.true_runs import runs
from solver.contact.wrenches import DETECTION, RECORDING
from solver.diagnosis.diagnosis_report import DiagnosisReport
from solver.kinematics.label_faults.fault import EXCHANGED, LabelFault

CONTACT = 0.34  # share of a foot's lane, at its lower border
DECIDED = 0.12  # likewise, at its upper one, of a proposal that is decided
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
    bottom: float = 0.0  # likewise, below it
    outlined: bool = False  # the one that keys act on
    foot: str | None = None  # that it is about; None: both, or none in particular
    is_flag: bool = False  # of a person's, whose borders can be moved
    hollow: bool = False  # an outline: nobody has decided


@dataclass(frozen=True)
class Lane:
    """One row."""

    label: str
    blocks: tuple[Block, ...]
    foot: str | None = None  # whose it is; None: of the trial


def lanes_of(
    replay: Replay,
    review: TrialReview,
    *,
    reviewed: Sequence[tuple[int, int]],
    proposals: Sequence[Pending],
    current: Pending | None,
    figures: DiagnosisReport | None,
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
    lanes = [
        Lane(
            f"{foot_words(foot)} foot",
            (
                *_contacts(replay, i),
                *_missing(replay, review, foot),
                *(_proposal(p, p is current) for p in proposals if p.proposal.foot in (None, foot)),
            ),
            foot,
        )
        for i, foot in enumerate(feet)
    ]
    lanes += _usable(replay)
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
    lanes.append(Lane("reviewed", tuple(Block(a, b, "", "looked at", REVIEWED) for a, b in reviewed)))
    if review.conflicts:
        disputed = (
            Block(c.start, c.end, "≠", conflict_words(c), VERMILION, foot=c.foot) for c in review.conflicts
        )
        lanes.append(Lane("disagree", tuple(disputed)))
    if replay.label_faults:
        lanes.append(Lane("labels", tuple(_label_fault(fault) for fault in replay.label_faults)))
    lanes += [] if figures is None else _causes(figures, replay.name)
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
            height=CONTACT,
            foot=replay.feet[phase.foot],
        )
        for phase in replay.forces.contacts
        if phase.foot == foot
    )


def _missing(replay: Replay, review: TrialReview, foot: str) -> tuple[Block, ...]:
    """What the next solve leaves out: of the recording's own, by detection, by files, by people."""
    flags = (*review.flags, *(review.stays_out or ()))
    mask = mask_now(replay.feet, replay.forces, review)
    told = [
        Block(
            flag.start,
            flag.end,
            key_of(flag.reason),
            ": ".join(filter(None, (reason_words(flag.reason), flag.author, flag.source, flag.note))),
            reason_color(flag.reason),
            hatched=flag.source in ("imported", "undecided proposal"),
            height=1.0 - CONTACT,
            bottom=CONTACT,
            foot=flag.foot,
            is_flag=flag in review.flags and flag.source not in ("imported", "undecided proposal"),
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
            key_of(reason) if source == RECORDING else "",  # the proposal above it says which
            f"{reason_words(reason)}: {known[source]}",
            reason_color(reason),
            hatched=True,
            height=1.0 - CONTACT,
            bottom=CONTACT,
            foot=of_foot,
        )
        for (start, end, of_foot, reason), source in zip(mask.reasons, mask.sources, strict=True)
        if of_foot in (None, foot) and source in known
    ]
    return (*others, *told)


def _proposal(pending: Pending, current: bool) -> Block:
    p = pending.proposal
    signs = {State.OPEN: "?", State.ACCEPTED: "✓", State.REJECTED: "✗"}
    foot = "all feet" if p.foot is None else foot_letter(p.foot)
    open_ = pending.state is State.OPEN
    return Block(
        p.start,
        p.end,
        f"{signs[pending.state]}{key_of(p.reason)}",
        f"{reason_words(p.reason)}, {foot}, {sure_words(p.confidence)} sure; {pending.state}",
        GREY,
        hatched=pending.state is State.REJECTED,
        height=(1.0 - CONTACT) * (0.6 + 0.4 * p.confidence) if open_ else DECIDED,
        bottom=CONTACT if open_ else 1.0 - DECIDED,
        outlined=current,
        foot=p.foot,
        hollow=open_,
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


def _usable(replay: Replay) -> list[Lane]:
    """Which frames the figures count, and why not the others."""
    if replay.residual is None:
        return []
    used = np.asarray(replay.residual.used)
    out = replay.forces.missing

    def why(start: int, end: int) -> str:
        reasons = dict.fromkeys(reason_words(reason) for a, b, _, reason in out if a < end and b > start)
        return "does not count: " + ("; ".join(reasons) or "first or last frames, or force not known")

    counted = [Block(int(a), int(b), "", "counts", COUNTS) for a, b in runs(used)]
    others = [Block(int(a), int(b), "", why(a, b), GREY, hatched=True) for a, b in runs(~used)]
    return [Lane("forces count", tuple(sorted((*counted, *others), key=lambda block: block.start)))]


def _causes(figures: DiagnosisReport, trial: str) -> list[Lane]:
    """One for each cause that names a part of the trial; ranges of a cause that overlap are one block."""
    lanes = []
    for effect in figures.effects:
        name, blocks = short_title(effect), list[Block]()
        for start, end in sorted((a, b) for of, a, b in effect.frames if of == trial):
            if blocks and start <= blocks[-1].end:
                blocks[-1] = replace(blocks[-1], end=max(end, blocks[-1].end))
            else:
                blocks.append(Block(start, end, name, name, CAUSE))
        if blocks:
            lanes.append(Lane("cause", tuple(blocks)))
    return lanes
