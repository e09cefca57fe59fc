"""The present state of a trial from its edits: a pure function, so that the log alone is the truth.

Each reviewer has a layer: that reviewer's last decision on every frame and foot. The latest of all persons'
decisions counts; imported labels count where no person has decided. Where two persons' layers disagree the
state says so. A finished trial also knows what a detector had left out and nobody had decided.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Int

from annotations.activities import ERRONEOUS
from annotations.events import (
    IMPORTED,
    AcceptProposal,
    ClearActivity,
    ClearRange,
    Edit,
    FlagRange,
    ImportLabels,
    ImportTable,
    Proposal,
    RefuseActivity,
    RejectProposal,
    SetActivity,
    SetStatus,
    Status,
    Unusable,
)
from annotations.label_runs import labelled_runs, true_runs
from annotations.reading import UnreadableRow
from annotations.reasons import FORCE_COUNTS, MANUAL_REVIEW
from annotations.review_errors import ReviewError
from annotations.trial_review import (
    ActivityRange,
    ClearedRange,
    Conflict,
    FlaggedRange,
    Opinion,
    Source,
    TrialReview,
)
from annotations.undoing import in_force

UNSAID = ""  # label of frames about whose activity somebody has taken the word back


class Decision(NamedTuple):
    """One label of a range of frames, and whose; hundreds are made for every picture of a trial's state."""

    start: int
    end: int
    foot: str | None  # None for all, and for activities
    label: str  # a reason, or that the force counts; of activities the class
    edit: int
    author: str
    source: Source = Source.PERSON
    subclass: str | None = None
    note: str = ""
    proposal: Proposal | None = None

    @property
    def words(self) -> str:
        """The label as people read it."""
        return f"{self.label} {self.subclass}" if self.subclass else self.label or "nothing"


def force_decisions(edit: Edit) -> Sequence[Decision]:
    """What an edit says about forces; one decision, or one a range of a table."""
    event, who = edit.event, (edit.number, edit.author)
    match event:
        case FlagRange() | ClearRange():
            return (_of_range(event, who, Source.PERSON),)
        case AcceptProposal(p):
            return (Decision(p.start, p.end, p.foot, p.reason, *who, source=Source.ACCEPTED, proposal=p),)
        case RejectProposal(p):
            return (Decision(p.start, p.end, p.foot, FORCE_COUNTS, *who, source=Source.REJECTED, proposal=p),)
        case ImportLabels(missing):
            return [
                Decision(start, end, None, MANUAL_REVIEW, *who, source=Source.IMPORTED)
                for start, end in missing
            ]
        case ImportTable():
            return [_of_range(labelled, who, Source.IMPORTED) for labelled in event.ranges]
        case _:
            return ()


def activity_decisions(edit: Edit) -> Sequence[Decision]:
    """What an edit says about activities."""
    event, who = edit.event, (edit.number, edit.author)
    match event:
        case SetActivity():
            return (_of_activity(event, who, Source.PERSON),)
        case ClearActivity(start, end):
            return (Decision(start, end, None, UNSAID, *who),)
        case ImportTable():
            return [_of_activity(activity, who, Source.IMPORTED) for activity in event.activities]
        case _:
            return ()


def replaces_imports(edit: Edit) -> bool:
    """Whether an edit takes the place of all that was imported before."""
    return isinstance(edit.event, ImportLabels | ImportTable)


def _of_range(labelled: FlagRange | ClearRange, who: tuple[int, str], source: Source) -> Decision:
    label = labelled.reason if isinstance(labelled, FlagRange) else FORCE_COUNTS
    return Decision(
        labelled.start, labelled.end, labelled.foot, label, *who, source=source, note=labelled.note
    )


def _of_activity(activity: SetActivity, who: tuple[int, str], source: Source) -> Decision:
    return Decision(
        activity.start,
        activity.end,
        None,
        activity.activity,
        *who,
        source=source,
        subclass=activity.subclass,
        note=activity.note,
    )


Layer = Int[np.ndarray, "stretches lanes"]  # which decision, counted from 1; 0 where there is none
Run = tuple[int, int]  # frames: the first, and the first after it


def folded(
    trial: str, edits: Sequence[Edit], feet: Sequence[str], unreadable: Sequence[UnreadableRow] = ()
) -> TrialReview:
    """What people have decided about a trial.

    Args:
        trial: its name.
        edits: its edits in order; those of one reviewer alone give that reviewer's opinion.
        feet: names of the subject's foot bodies.
        unreadable: rows that are passed over and may be about the trial; of the state they change only that
            a trial about which nothing else is known is not unseen.

    Raises:
        ReviewError: an edit is about a foot that the subject does not have.
    """
    kept, lanes = in_force(edits), tuple(feet)
    forces = _Layers(trial, kept, force_decisions, lanes)
    activities = _Layers(trial, kept, activity_decisions, ())
    status, status_author, status_note = _status(kept)
    if status is Status.UNSEEN and status_author is None and any(row.trial == trial for row in unreadable):
        status = Status.IN_WORK
    labelled = forces.in_effect()
    review = TrialReview(
        trial=trial,
        feet=lanes,
        status=status,
        status_author=status_author,
        status_note=status_note,
        decided=_decided(kept),
        flags=tuple(_flag(run, foot, d) for run, foot, d in labelled if d.label != FORCE_COUNTS),
        cleared=tuple(_cleared(run, foot, d) for run, foot, d in labelled if d.label == FORCE_COUNTS),
        activities=_activities(activities),
        conflicts=(*forces.conflicts(), *activities.conflicts()),
        accepted=tuple(e.event.proposal for e in kept if isinstance(e.event, AcceptProposal)),
        rejected=tuple(e.event.proposal for e in kept if isinstance(e.event, RejectProposal)),
        refused_activities=tuple(e.event for e in kept if isinstance(e.event, RefuseActivity)),
        file_counts=_file_counts(kept),
        unusable=_unusable(kept),
        unreadable=tuple(unreadable),
    )
    return replace(review, stays_out=_stays_out(kept, review))


class _Layers:
    """Who decided what on every stretch of frames and lane; a lane is a foot, or the one of the activities.

    Stretches lie between the frames at which some decision begins or ends, so that a long trial costs no more
    than a short one.
    """

    def __init__(
        self,
        trial: str,
        kept: Sequence[Edit],
        decisions_of: Callable[[Edit], Sequence[Decision]],
        feet: tuple[str, ...],
    ) -> None:
        self._trial, self._feet = trial, feet
        by_edit = [(edit, decisions_of(edit)) for edit in kept]
        self._decisions = [decision for _, decisions in by_edit for decision in decisions]
        self._flagged = np.array([False, *(d.label != FORCE_COUNTS for d in self._decisions)])
        self._ends = sorted({end for d in self._decisions for end in (d.start, d.end)})
        self._stretch = {frame: k for k, frame in enumerate(self._ends)}
        self._shape = (max(0, len(self._ends) - 1), len(feet) if decisions_of is force_decisions else 1)
        self._lanes: dict[str | None, slice] = {foot: slice(k, k + 1) for k, foot in enumerate(feet)}
        self._lanes[None] = slice(None)
        self._by_author: dict[str, Layer] = {}
        self._latest: Layer = np.zeros(self._shape, dtype=np.int64)  # of all persons
        number = 0
        for edit, decisions in by_edit:
            if replaces_imports(edit):
                self._by_author.pop(edit.author, None)
            for decision in decisions:
                number += 1
                self._lay(number, decision)

    def _lay(self, number: int, decision: Decision) -> None:
        if decision.author not in self._by_author:
            self._by_author[decision.author] = np.zeros(self._shape, dtype=np.int64)
        layer = self._by_author[decision.author]
        lane = self._lanes.get(decision.foot)
        if lane is None:
            raise self._unknown_foot(decision)
        part = (slice(self._stretch[decision.start], self._stretch[decision.end]), lane)
        if decision.source is Source.REJECTED:
            by_hand = self._flagged[self._latest[part]]
            layer[part] = np.where(by_hand, layer[part], number)
            self._latest[part] = np.where(by_hand, self._latest[part], number)
            return
        layer[part] = number
        if decision.author != IMPORTED:
            self._latest[part] = number

    def _unknown_foot(self, decision: Decision) -> ReviewError:
        return ReviewError(
            f"{self._trial}: edit {decision.edit} by {decision.author} is about the foot '{decision.foot}'; "
            f"the subject has {', '.join(self._feet)}. Undo that edit, or name the foot among the subject's "
            "foot bodies"
        )

    def in_effect(self) -> list[tuple[Run, str | None, Decision]]:
        """The decision that counts on each range of frames, and its foot; None for all."""
        effect = np.where(self._latest > 0, self._latest, self._by_author.get(IMPORTED, 0))
        return [(run, foot, self._decisions[number - 1]) for run, foot, number in self._runs(effect)]

    def conflicts(self) -> tuple[Conflict, ...]:
        """Where two persons' layers disagree."""
        opinions = [Opinion(d.author, d.words, d.edit) for d in self._decisions]
        codes = np.array([0, *_codes([opinion.label for opinion in opinions])])
        conflicts = []
        persons = sorted(author for author in self._by_author if author != IMPORTED)
        for one, other in combinations(persons, 2):
            a, b = self._by_author[one], self._by_author[other]
            differ: Bool[np.ndarray, "stretches lanes"] = (a > 0) & (b > 0) & (codes[a] != codes[b])
            pairs = np.where(differ, a * len(codes) + b, 0)
            for (start, end), foot, pair in self._runs(pairs):
                k, m = divmod(pair, len(codes))
                conflicts.append(Conflict(start, end, foot, opinions[min(k, m) - 1], opinions[max(k, m) - 1]))
        return tuple(sorted(conflicts, key=lambda conflict: (conflict.start, conflict.end)))

    def _runs(self, values: Layer) -> list[tuple[Run, str | None, int]]:
        """Ranges of equal values above 0 with their foot; None where all lanes have the very same range."""
        by_lane = [labelled_runs(values[:, lane]) for lane in range(values.shape[1])]
        common = set(by_lane[0]).intersection(*by_lane[1:]) if by_lane else set()
        found: list[tuple[tuple[int, int, int], str | None]] = [(run, None) for run in common]
        found += [
            (run, foot)
            for foot, runs in zip(self._feet, by_lane, strict=False)
            for run in runs
            if run not in common
        ]
        return [
            ((self._ends[start], self._ends[end]), foot, value)
            for (start, end, value), foot in sorted(found, key=lambda run_and_foot: run_and_foot[0])
        ]


def _codes(words: Sequence[str]) -> list[int]:
    """The same number for the same words."""
    known = {word: number for number, word in enumerate(dict.fromkeys(words), start=1)}
    return [known[word] for word in words]


def _flag(run: Run, foot: str | None, decision: Decision) -> FlaggedRange:
    proposal = decision.proposal
    return FlaggedRange(
        start=run[0],
        end=run[1],
        foot=foot,
        reason=decision.label,
        source=decision.source,
        author=decision.author,
        edit=decision.edit,
        note=decision.note,
        confidence=None if proposal is None else proposal.confidence,
        detector="" if proposal is None else proposal.detector,
    )


def _cleared(run: Run, foot: str | None, decision: Decision) -> ClearedRange:
    return ClearedRange(run[0], run[1], foot, decision.source, decision.author, decision.edit, decision.note)


def _file_counts(kept: Sequence[Edit]) -> tuple[Run, ...] | None:
    """Where the last import says that every force counts; a table says so with ranges of its own."""
    imports = [edit.event for edit in kept if isinstance(edit.event, ImportLabels | ImportTable)]
    match imports[-1:]:
        case [ImportLabels(missing, frames, unreviewed=unreviewed)]:
            counts = np.ones(frames, dtype=bool)
            for start, end in (*missing, *unreviewed):
                counts[start:end] = False
            return tuple(true_runs(counts))
        case [ImportTable()]:
            return ()
        case _:
            return None


def _stays_out(kept: Sequence[Edit], review: TrialReview) -> tuple[FlaggedRange, ...] | None:
    """What was undecided when the trial was finished and is so still; None where detection is asked."""
    if review.status is not Status.FINISHED:
        return None
    persons = [e for e in kept if e.author != IMPORTED and isinstance(e.event, SetStatus)]
    if not persons:
        return () if any(isinstance(e.event, ImportTable) for e in kept) else None
    finishing = persons[-1]
    assert isinstance(finishing.event, SetStatus)
    if finishing.event.left_out is None:
        return None
    whose = (finishing.number, finishing.author)
    found = [
        _flag(run, foot, Decision(*run, foot, p.reason, *whose, source=Source.UNDECIDED, proposal=p))
        for p in finishing.event.left_out
        for run, foot in _undecided(p, review)
    ]
    return tuple(sorted(found, key=lambda flag: (flag.start, flag.end)))


def _undecided(proposal: Proposal, review: TrialReview) -> list[tuple[Run, str | None]]:
    """Where nobody has decided about a proposal; one range where that is the same for all feet."""
    judged = review.judged(proposal.end, by_files=True)[proposal.start :]
    feet = review.feet if proposal.foot is None else (proposal.foot,)
    by_foot = {
        foot: [
            (proposal.start + start, proposal.start + end)
            for start, end in true_runs(~judged[:, review.feet.index(foot)])
        ]
        for foot in feet
    }
    first = by_foot[feet[0]]
    if proposal.foot is None and all(runs == first for runs in by_foot.values()):
        return [(run, None) for run in first]
    return [(run, foot) for foot, runs in by_foot.items() for run in runs]


def _activities(layers: _Layers) -> tuple[ActivityRange, ...]:
    found = []
    for run, _, said in layers.in_effect():
        if said.label != UNSAID:
            found.append(
                ActivityRange(run[0], run[1], said.label, said.subclass, said.author, said.edit, said.note)
            )
    return tuple(found)


def _status(kept: Sequence[Edit]) -> tuple[Status, str | None, str]:
    """The last status that a person set; in work from the first edit on; else what was imported."""
    persons = [edit for edit in kept if edit.author != IMPORTED]
    for edit in reversed(persons):
        if isinstance(edit.event, SetStatus):
            return edit.event.status, edit.author, edit.event.note
    if persons:
        return Status.IN_WORK, persons[-1].author, ""
    imports = [edit.event for edit in kept if isinstance(edit.event, ImportLabels | ImportTable)]
    match imports[-1:]:
        case [ImportLabels(finished=True)]:
            return Status.FINISHED, IMPORTED, ""
        case [ImportTable(status=Status() as status, status_note=note)]:
            return status, IMPORTED, note
        case _:
            return Status.UNSEEN, None, ""


def _unusable(kept: Sequence[Edit]) -> Unusable | None:
    """What the last person who said how far the review is called it unusable for."""
    said = [e.event for e in kept if e.author != IMPORTED and isinstance(e.event, SetStatus)]
    return said[-1].unusable if said else None


def _decided(kept: Sequence[Edit]) -> bool:
    """Whether a person judged forces or took the trial in hand; saying what was done there is neither.

    To take in a table of labels is to judge by it.
    """
    if any(isinstance(edit.event, ImportTable) for edit in kept):
        return True
    events = [edit.event for edit in kept if edit.author != IMPORTED]
    judged = any(isinstance(e, FlagRange | ClearRange | AcceptProposal | RejectProposal) for e in events)
    discarded = any(isinstance(e, SetActivity) and e.activity == ERRONEOUS for e in events)
    statuses = [e.status for e in events if isinstance(e, SetStatus)]
    return judged or discarded or (bool(statuses) and statuses[-1] is not Status.UNSEEN)
