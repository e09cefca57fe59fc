"""What happens in a trial, as lanes of stretches and as lines of a log: the same for every kind of file."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from addb_viewer.text.diagnosis_vocabulary import amounts, sentence, title
from addb_viewer.trial_view.lanes import Block, Lane
from addb_viewer.trial_view.palette import CAUSE, GREEN, GREY, ORANGE, Rgb, foot_color, reason_color
from addb_viewer.trial_view.recorded_subject import Recording, TrialRecord
from annotations.events import Edit, FrameRange
from annotations.foot_names import foot_words
from annotations.reasons import reason_words
from annotations.wording import said
from solver.common.true_runs import runs
from solver.diagnosis.diagnosis_report import Cause, DiagnosisReport


@dataclass(frozen=True)
class Line:
    """One line of a log."""

    frame: int
    source: str  # "note", "flag", "cause" or "review"
    text: str
    is_warning: bool = False


def lanes_of(record: TrialRecord, diagnosis: DiagnosisReport | None) -> tuple[Lane, ...]:
    """Contacts, missing forces and who decided, frames used, proposals, named causes.

    Args:
        record: the trial.
        diagnosis: in the shape of `diagnose --json`; None where nobody asked.
    """
    replay, forces = record.replay, record.replay.forces
    lanes = []
    for i, foot in enumerate(replay.feet):
        phases = [phase for phase in forces.contacts if phase.foot == i]
        contacts = tuple(
            _block(p.start, p.end, "on a plate", foot_color(foot, i))
            if p.is_measured
            else _block(p.start, p.end, "no plate carries it", GREY)
            for p in phases
        )
        lanes.append(Lane(f"contact {foot_words(foot)}", contacts))
    for foot in replay.feet:
        missing = tuple(
            _block(start, end, reason_words(reason), reason_color(reason))
            for start, end, of_foot, reason in forces.missing
            if of_foot in (None, foot)
        )
        lanes.append(Lane(f"force missing {foot_words(foot)}", missing))
    if replay.residual is not None:
        used = tuple(_block(start, end, "used", GREEN) for start, end in runs(replay.residual.used))
        lanes.append(Lane("forces used", used))
    if forces.proposals:
        proposed = tuple(
            _block(*p.range, f"{reason_words(p.reason)}, {100 * p.confidence:.0f} % sure", ORANGE)
            for p in sorted(forces.proposals, key=lambda p: p.confidence)
        )
        lanes.append(Lane("proposed by detection", proposed))
    for k, (effect, frames) in enumerate(_causes(record, diagnosis), start=1):
        acts = tuple(_block(start, end, title(effect), CAUSE) for start, end in frames)
        lanes.append(Lane(f"cause {k}", acts))
    return tuple(lanes)


def lines_of(record: TrialRecord, recording: Recording) -> tuple[Line, ...]:
    """Notes, flags, named causes and edits of a trial, by frame.

    Args:
        record: the trial.
        recording: that it belongs to.
    """
    name, last = record.replay.name, record.replay.frames - 1
    others = [other.replay.name for other in recording.trials if other is not record]
    notes = [note for note in recording.notes if note.trial not in others]
    lines = [Line(0, "note", note.removeprefix(f"{name}: ")) for note in notes]
    lines += [Line(0, "note", why, is_warning=True) for why in record.analog[1]]
    for k, (start, end, foot, reason) in enumerate(record.replay.forces.missing):
        feet = foot or "all feet"
        words = reason_words(reason)
        why = words if words == reason else f"{words} ({reason})"
        text = f"frames {start} to {end - 1}, {feet}: {why}, left out by {record.replay.forces.source_of(k)}"
        lines.append(Line(start, "flag", text, is_warning=True))
    for effect, frames in _causes(record, recording.diagnosis):
        told = [title(effect), *amounts(effect)]
        text = f"{'; '.join(told)}. {sentence(effect)} {100 * effect.confidence:.0f} % sure."
        lines += [Line(start, "cause", f"frames {start} to {end - 1}: {text}", True) for start, end in frames]
    lines += [Line(min(_frame_of(e), last), "review", said(e)) for e in recording.edits if e.trial == name]
    return tuple(sorted(lines, key=lambda line: line.frame))


def states_of(lane: Lane, frames: int) -> list[tuple[int, str]]:
    """Where a lane's state changes, and to what; "" where there is none.

    Args:
        lane: of `lanes_of`; where blocks overlap, the later one shows.
        frames: of the trial.
    """
    texts = ["", *dict.fromkeys(block.text for block in lane.blocks)]
    shown = np.zeros(frames, dtype=int)
    for block in lane.blocks:
        shown[block.start : block.end] = texts.index(block.text)
    changes = np.flatnonzero(np.diff(shown, prepend=0))
    return [(int(frame), texts[shown[frame]]) for frame in changes]


def _block(start: int, end: int, state: str, color: Rgb) -> Block:
    return Block(start, end, state, state, color)


def _causes(
    record: TrialRecord, diagnosis: DiagnosisReport | None
) -> list[tuple[Cause, Sequence[tuple[int, int]]]]:
    """The causes that act in a trial, and when."""
    found: list[tuple[Cause, Sequence[tuple[int, int]]]] = []
    for effect in diagnosis.effects if diagnosis else ():
        frames = [(start, end) for trial, start, end in effect.frames if trial == record.replay.name]
        if frames:
            found.append((effect, frames))
    return found


def _frame_of(edit: Edit) -> int:
    """The first frame that an edit is about; the trial's first where it is about all."""
    about = getattr(edit.event, "proposal", edit.event)
    return about.start if isinstance(about, FrameRange) else 0
