"""The present state of a trial from its edits: a pure function, so that the log alone is the truth.

Each reviewer has a layer: the number of that reviewer's last edit on every frame and foot. The latest of all
persons' edits counts; imported labels count where no person has decided. Where two persons' layers disagree
the state says so.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from jaxtyping import Int

from annotations.activities import ERRONEOUS
from annotations.errors import ReviewError
from annotations.events import (
    IMPORTED,
    AcceptProposal,
    ClearRange,
    Edit,
    FlagRange,
    ImportLabels,
    RejectProposal,
    SetActivity,
    SetStatus,
    Status,
)
from annotations.reasons import FORCE_COUNTS, MANUAL_REVIEW
from annotations.runs import labelled_runs
from annotations.trial_review import ActivityRange, Conflict, FlaggedRange, Opinion, Source, TrialReview
from annotations.undoing import in_force

Layers = dict[str, Int[np.ndarray, "frames lanes"]]  # by author; 0 where the author has not decided
Run = tuple[int, int, int]  # start, end, value


def folded(trial: str, edits: Sequence[Edit], feet: Sequence[str]) -> TrialReview:
    """What people have decided about a trial.

    Args:
        trial: its name.
        edits: its edits in order; those of one reviewer alone give that reviewer's opinion.
        feet: names of the subject's foot bodies.

    Raises:
        ReviewError: an edit is about a foot that the subject does not have.
    """
    kept = in_force(edits)
    by_number = {edit.number: edit for edit in kept}
    frames = max((_end(edit) for edit in kept), default=0)
    forces = _force_layers(kept, frames, tuple(feet))
    activities = _activity_layers(kept, frames)
    status, status_author = _status(kept)
    return TrialReview(
        trial=trial,
        feet=tuple(feet),
        status=status,
        status_author=status_author,
        decided=_decided(kept),
        flags=_flags(_in_effect(forces), tuple(feet), by_number),
        activities=_activities(_in_effect(activities), by_number),
        conflicts=(*_conflicts(forces, tuple(feet), by_number), *_conflicts(activities, (), by_number)),
        accepted=tuple(e.event.proposal for e in kept if isinstance(e.event, AcceptProposal)),
        rejected=tuple(e.event.proposal for e in kept if isinstance(e.event, RejectProposal)),
    )


@dataclass(frozen=True)
class _Decision:
    """What an edit says about the force on a range of frames."""

    start: int
    end: int
    foot: str | None
    label: str  # the reason, or that the force counts
    source: Source = Source.PERSON
    note: str = ""


def _decision(edit: Edit) -> _Decision | None:
    match edit.event:
        case FlagRange(start, end, reason, foot, note):
            return _Decision(start, end, foot, reason, note=note)
        case ClearRange(start, end, foot, note):
            return _Decision(start, end, foot, FORCE_COUNTS, note=note)
        case AcceptProposal(proposal):
            return _Decision(proposal.start, proposal.end, proposal.foot, proposal.reason, Source.ACCEPTED)
        case RejectProposal(proposal):
            return _Decision(proposal.start, proposal.end, proposal.foot, FORCE_COUNTS)
        case ImportLabels():
            return _Decision(0, edit.event.frames, None, MANUAL_REVIEW, Source.IMPORTED)
        case _:
            return None


def _end(edit: Edit) -> int:
    decision = _decision(edit)
    if decision is not None:
        return decision.end
    return edit.event.end if isinstance(edit.event, SetActivity) else 0


def _status(kept: Sequence[Edit]) -> tuple[Status, str | None]:
    """The last status that a person set; in work from the first edit on; else what was imported."""
    persons = [edit for edit in kept if edit.author != IMPORTED]
    for edit in reversed(persons):
        if isinstance(edit.event, SetStatus):
            return edit.event.status, edit.author
    if persons:
        return Status.IN_WORK, persons[-1].author
    imports = [edit.event for edit in kept if isinstance(edit.event, ImportLabels)]
    if imports and imports[-1].finished:
        return Status.FINISHED, IMPORTED
    return Status.UNSEEN, None


def _decided(kept: Sequence[Edit]) -> bool:
    """Whether a person judged forces or took the trial in hand; saying what was done there is neither."""
    events = [edit.event for edit in kept if edit.author != IMPORTED]
    judged = any(isinstance(e, FlagRange | ClearRange | AcceptProposal | RejectProposal) for e in events)
    discarded = any(isinstance(e, SetActivity) and e.activity == ERRONEOUS for e in events)
    statuses = [e.status for e in events if isinstance(e, SetStatus)]
    return judged or discarded or (bool(statuses) and statuses[-1] is not Status.UNSEEN)


def _force_layers(kept: Sequence[Edit], frames: int, feet: tuple[str, ...]) -> Layers:
    layers: Layers = {}
    flags = [edit.number for edit in kept if _is_flag(edit)]
    for edit in kept:
        decision = _decision(edit)
        if decision is None:
            continue
        layer = layers.setdefault(edit.author, np.zeros((frames, len(feet)), dtype=np.int64))
        if isinstance(edit.event, ImportLabels):
            layer[:] = 0
            for start, end in edit.event.missing:
                layer[start:end] = edit.number
            continue
        part = (slice(decision.start, decision.end), _lane(decision.foot, feet, edit))
        if isinstance(edit.event, RejectProposal):
            by_hand = np.isin(_latest_of_persons(layers, layer.shape)[part], flags)
            layer[part] = np.where(by_hand, layer[part], edit.number)
        else:
            layer[part] = edit.number
    return layers


def _is_flag(edit: Edit) -> bool:
    decision = _decision(edit)
    return decision is not None and decision.label != FORCE_COUNTS


def _lane(foot: str | None, feet: tuple[str, ...], edit: Edit) -> slice:
    if foot is None:
        return slice(None)
    if foot not in feet:
        raise ReviewError(
            f"{edit.trial}: edit {edit.number} by {edit.author} is about the foot '{foot}'; the subject has "
            f"{', '.join(feet)}. Undo that edit, or name the foot among the subject's foot bodies"
        )
    return slice(feet.index(foot), feet.index(foot) + 1)


def _activity_layers(kept: Sequence[Edit], frames: int) -> Layers:
    layers: Layers = {}
    for edit in kept:
        if isinstance(edit.event, SetActivity):
            layer = layers.setdefault(edit.author, np.zeros((frames, 1), dtype=np.int64))
            layer[edit.event.start : edit.event.end] = edit.number
    return layers


def _latest_of_persons(layers: Layers, shape: tuple[int, ...]) -> Int[np.ndarray, "frames lanes"]:
    persons = [layer for author, layer in layers.items() if author != IMPORTED]
    return np.maximum.reduce([np.zeros(shape, dtype=np.int64), *persons])


def _in_effect(layers: Layers) -> Int[np.ndarray, "frames lanes"]:
    """Which edit counts on each frame and lane; 0 for none."""
    if not layers:
        return np.zeros((0, 0), dtype=np.int64)
    shape = next(iter(layers.values())).shape
    decided = _latest_of_persons(layers, shape)
    return np.where(decided > 0, decided, layers.get(IMPORTED, 0))


def _flags(
    effect: Int[np.ndarray, "frames feet"], feet: tuple[str, ...], by_number: Mapping[int, Edit]
) -> tuple[FlaggedRange, ...]:
    flags = []
    for (start, end, number), foot in _joined_runs(effect, feet):
        edit, decision = by_number[number], _decision(by_number[number])
        if decision is not None and decision.label != FORCE_COUNTS:
            flags.append(
                FlaggedRange(
                    start, end, foot, decision.label, decision.source, edit.author, number, decision.note
                )
            )
    return tuple(flags)


def _activities(
    effect: Int[np.ndarray, "frames 1"], by_number: Mapping[int, Edit]
) -> tuple[ActivityRange, ...]:
    activities = []
    for (start, end, number), _ in _joined_runs(effect, ()):
        edit = by_number[number]
        if isinstance(edit.event, SetActivity):
            event = edit.event
            activities.append(ActivityRange(start, end, event.activity, event.subclass, edit.author, number))
    return tuple(activities)


def _conflicts(layers: Layers, feet: tuple[str, ...], by_number: Mapping[int, Edit]) -> tuple[Conflict, ...]:
    conflicts = []
    persons = sorted(author for author in layers if author != IMPORTED)
    for one, other in combinations(persons, 2):
        a, b = layers[one], layers[other]
        pairs, which = np.unique(np.stack([a, b], axis=-1).reshape(-1, 2), axis=0, return_inverse=True)
        differ = [x > 0 and y > 0 and _label(by_number[x]) != _label(by_number[y]) for x, y in pairs.tolist()]
        coded = np.where(differ, np.arange(1, len(pairs) + 1), 0)[which].reshape(a.shape)
        for (start, end, code), foot in _joined_runs(coded, feet):
            earlier, later = (_opinion(by_number[number]) for number in sorted(pairs[code - 1].tolist()))
            conflicts.append(Conflict(start, end, foot, earlier, later))
    return tuple(sorted(conflicts, key=lambda conflict: (conflict.start, conflict.end)))


def _label(edit: Edit) -> str:
    if isinstance(edit.event, SetActivity):
        return " ".join(filter(None, (edit.event.activity, edit.event.subclass)))
    decision = _decision(edit)
    return decision.label if decision is not None else ""


def _opinion(edit: Edit) -> Opinion:
    return Opinion(edit.author, _label(edit), edit.number)


def _joined_runs(
    values: Int[np.ndarray, "frames lanes"], feet: tuple[str, ...]
) -> list[tuple[Run, str | None]]:
    """Runs of equal values above 0 with their foot; None where all lanes have the very same run."""
    by_lane = [labelled_runs(values[:, lane]) for lane in range(values.shape[1])]
    common = set(by_lane[0]).intersection(*by_lane[1:]) if by_lane else set()
    single = [(run, feet[lane]) for lane, runs in enumerate(by_lane) for run in runs if run not in common]
    return sorted([*((run, None) for run in common), *single], key=lambda found: found[0])
