"""What a reader must know before anything else: how much is usable, how good it is, what is wrong."""

from dataclasses import dataclass

import numpy as np

from addb_viewer.report.content import SubjectReport
from addb_viewer.report.frames_kept import NO_FORCES, Kept, decided_by, frames_words, in_all, seconds_words
from addb_viewer.report.markup import Safe, element, joined
from addb_viewer.text.change_words import change_sentence
from addb_viewer.text.diagnosis_vocabulary import listed
from addb_viewer.text.judged_figures import LARGEST_MARKER, SOURCE, judged_figures
from addb_viewer.text.verdict_words import verdict
from addb_viewer.trial_view.recorded_subject import TrialRecord
from solver.contact.wrenches import DETECTION
from solver.diagnosis.diagnosis_report import DiagnosisReport

FEW = 0.5  # share of frames below which figures say little about the whole trial
MOST_REASONS, MOST_RANGES, MOST_STRIPS = 3, 4, 6
MOST_CHANGES = 2  # trials whose changed motion is told at the top
GOOD, DOUBT, BAD, PLAIN = ("good", "✓"), ("doubt", "!"), ("bad", "✗"), ("plain", "i")


def key_findings(report: SubjectReport) -> Safe:
    """What each trial is good for, and three answers to why."""
    answers = (_frames(report), _bounds(report), _diagnosis(report))
    return joined((_verdicts(report), element("section", *answers, id="in-short", aria_label="In short")))


def _verdicts(report: SubjectReport) -> Safe:
    """The line of each trial."""
    named = zip(report.recording.trials, report.verdicts, strict=True)
    lines = [
        element("p", element("b", f"{record.replay.name}: "), verdict.line.text) for record, verdict in named
    ]
    return element("section", *lines, id="verdicts", aria_label="Verdicts")


def frames_sentence(kept: tuple[Kept, ...]) -> str:
    """How many frames count."""
    count, frames = in_all(kept)
    return f"{count} of {frames} frames are usable ({100 * count / max(frames, 1):.0f} %)"


def reasons(kept: tuple[Kept, ...]) -> list[str]:
    """Why the others are not, the most frequent reason first."""
    taken: dict[tuple[str, str], int] = {}
    for trial in kept:
        for cause in trial.causes:
            key = (cause.foot_words, cause.meaning or cause.words)
            taken[key] = taken.get(key, 0) + cause.frames
    ordered = sorted(taken.items(), key=lambda item: -item[1])
    said = [f"{frames} frames, {feet}: {_within(why)}" for (feet, why), frames in ordered[:MOST_REASONS]]
    if len(ordered) > MOST_REASONS:
        rest = len(ordered) - MOST_REASONS
        said.append(f"{rest} more reason{'s' if rest > 1 else ''}, below")
    return said


def _within(sentence: str) -> str:
    """A sentence as the end of another one."""
    return sentence[:1].lower() + sentence[1:].rstrip(".")


@dataclass(frozen=True)
class Bounds:
    """How many of the bounds are met, over all trials, and what is beyond or was not computed."""

    met: int
    judged: int
    beyond: tuple[str, ...]
    unknown: tuple[str, ...]

    @property
    def words(self) -> str:
        """In one clause."""
        if not self.judged:
            return "No bound could be checked"
        of = f"{self.judged} bounds are met"
        return f"All {of}" if self.met == self.judged else f"{self.met} of {of}"


def bounds_of(report: SubjectReport) -> Bounds:
    """The four figures of every trial against their bounds."""
    beyond: dict[str, list[str]] = {}
    unknown: dict[str, list[str]] = {}
    met = 0
    several = len(report.recording.trials) > 1
    for record in report.recording.trials:
        trial = record.replay.name if several else ""
        for judged in judged_figures(record.figures):
            if judged.within is None:
                unknown.setdefault(judged.label, []).append(trial)
            elif judged.within:
                met += 1
            else:
                at = _worst(record) if judged.label == LARGEST_MARKER else ""
                told = f"{trial} {judged.value}{at}".strip()
                beyond.setdefault(f"{judged.label}, bound {judged.bound}", []).append(told)
    return Bounds(
        met,
        met + sum(map(len, beyond.values())),
        tuple(f"{label}: {'; '.join(values)}" for label, values in beyond.items()),
        tuple(f"{label}{of}" for label, trials in unknown.items() for of in [_of(trials)]),
    )


def _of(trials: list[str]) -> str:
    named = ", ".join(filter(None, trials))
    return f" of {named}" if named else ""


def _worst(record: TrialRecord) -> str:
    """Which marker, and when."""
    errors = record.replay.markers.errors
    frame, marker = np.unravel_index(np.nanargmax(errors), errors.shape)
    return f" ({record.replay.markers.names[marker]}, frame {frame})"


def _frames(report: SubjectReport) -> Safe:
    kept = report.kept
    count, frames = in_all(kept)
    lines: list[str] = []
    if len(kept) == 1 and 0 < len(kept[0].ranges) <= MOST_RANGES:
        times = report.recording.trials[0].replay.times
        places = [f"{frames_words(*r)} ({seconds_words(*r, times)})" for r in kept[0].ranges]
        lines.append(f"Usable: frames {listed(places)}.")
    names = [record.replay.name if len(kept) > 1 else "" for record in report.recording.trials]
    strips = [_of_trial(name, of) for name, of in zip(names, kept, strict=True)]
    lines += strips[:MOST_STRIPS]
    if said := reasons(kept):
        lines.append("Left out:")
        lines.append(element("ul", *(element("li", reason) for reason in said)))
    if any(len(trial.causes) > 1 for trial in kept):
        lines.append("A frame is usable when the forces of both feet are; so reasons overlap.")
    sources = [record.figures.mask_source for record in report.recording.trials]
    who = [decided_by(source, of) for source, of in zip(sources, kept, strict=True)]
    lines.append(f"Who decided: {listed(list(dict.fromkeys(who)))}.")
    unconfirmed = any(DETECTION in source for source in sources)
    bad = not count and {cause.reason for trial in kept for cause in trial.causes} != {NO_FORCES}
    kind = BAD if bad else DOUBT if count < FEW * frames or unconfirmed else GOOD
    return _card(kind, frames_sentence(kept), lines)


def _of_trial(name: str, kept: Kept) -> Safe:
    """Its strip; named where there are several."""
    if not name:
        return strip(kept)
    told = element("span", f"{name}: {kept.count} of {kept.frames}")
    return element("div", told, strip(kept), class_="of-trial")


def strip(kept: Kept) -> Safe:
    """The trial from left to right, with its usable stretches."""
    percent = 100 / kept.frames
    blocks = "".join(
        f'<i style="left:{percent * start:.2f}%;width:{percent * (end - start):.2f}%"></i>'
        for start, end in kept.ranges
    )
    return element("div", Safe(blocks), class_="strip", title="usable stretches, from start to end")


def _bounds(report: SubjectReport) -> Safe:
    bounds = bounds_of(report)
    count, frames = in_all(report.kept)
    lines: list[str] = []
    for words, entries in (("Beyond:", bounds.beyond), ("Not computed:", bounds.unknown)):
        if entries:
            lines += [words, element("ul", *(element("li", entry) for entry in entries))]
    lines.append(f"Bounds of {SOURCE} for residual force and moment and for marker errors.")
    if 0 < count < FEW * frames:
        lines.append(f"Residuals are about the {count} usable frames alone and say nothing about the others.")
    lines += _changes(report)
    kind = PLAIN if not bounds.judged else GOOD if not bounds.beyond else BAD
    return _card(kind, bounds.words, lines)


def _changes(report: SubjectReport) -> list[str]:
    """What the residuals may have cost, of the trials that were changed most."""
    records = [r for r in report.recording.trials if change_sentence(r.figures.change)]
    records.sort(key=lambda r: -((r.figures.change and r.figures.change.joints_rms_deg) or 0.0))
    name = len(report.recording.trials) > 1
    told = [
        f"{f'{r.replay.name}: ' if name else ''}{change_sentence(r.figures.change)}."
        for r in records[:MOST_CHANGES]
    ]
    if len(records) > MOST_CHANGES:
        told.append("The other trials were changed less.")
    return told


def _diagnosis(report: SubjectReport) -> Safe:
    figures = report.diagnosis.figures
    kind, head = verdict_kind(figures)
    return _card(kind, head, [report.diagnosis.absent] if figures is None else list(verdict(figures).lines))


def verdict_kind(figures: DiagnosisReport | None) -> tuple[tuple[str, str], str]:
    """How good the verdict is, and what it says in a few words.

    Args:
        figures: in the shape of `diagnose --json`; None: nobody asked.
    """
    if figures is None:
        return PLAIN, "No diagnosis"
    if figures.verdict == "clean":
        return GOOD, "No fault found in the recordings"
    if figures.verdict == "explained":
        return DOUBT, "A fault in the recordings, with a named cause"
    return BAD, "A fault in the recordings that is not explained"


def _card(kind: tuple[str, str], head: str, lines: list[str]) -> Safe:
    name, sign = kind
    return element(
        "div",
        element("p", element("span", sign, class_="sign", aria_hidden="true"), element("b", head)),
        joined(line if isinstance(line, Safe) else element("p", line) for line in lines),
        class_=f"card {name}",
    )
