"""What there is before anything is fitted: subjects, trials, which a release takes, which deserve a look."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from addb_viewer.dataset.build_task import LeftOut, hours_of
from addb_viewer.dataset.grid import SHORTEST, grid_of
from addb_viewer.dataset.identifiers import labels_without_names
from addb_viewer.dataset.release_errors import ReleaseError
from addb_viewer.dataset.release_subject import (
    NO_SPDX,
    BuildOptions,
    ReleaseSubject,
    is_spdx,
    release_subject,
)
from addb_viewer.dataset.same_recording import Places, Recording, recording_of, same_recordings
from addb_viewer.dataset.trial_labels import TrialLabels, labels_of, named_causes
from addb_viewer.text.note_words import by_kind
from annotations.foot_names import side_of
from annotations.review_errors import ReviewError
from solver.capture.capture import Capture, Markers, Subject, TrialFiles
from solver.capture.subject.opened_subject import subjects_in
from solver.capture.subject.unused_files import MARKERS
from solver.capture.trial import ReadingSettings, read_trial
from solver.common.errors import SolverError
from solver.common.file_names import readable
from solver.common.notes import Note
from solver.contact.wrenches import DETECTION
from solver.diagnosis.diagnosis_report import Cause
from solver.fitting.fit_summary import read_summary
from solver.fitting.results.store import default_folder
from solver.fitting.settings import settings_for

BETTER = (
    "its review is finished",
    "it is longer",
    "it has more frames a second",
    "it has more samples of force a second",
    "it is no processed file",
    "more of its markers are seen",
)
"""Of two recordings of the same: what one has before the other, the most important first."""
WITHDRAWN = LeftOut("subject", "withdrawn", "withdrawn")
"""Whoever it is."""
KEPT_BYTES = 300_000_000  # of markers, while they are compared


@dataclass(frozen=True)
class ScannedTrial:
    """A trial as its files have it."""

    name: str
    frames: int
    rate_hz: float
    trial_id: str
    worth: tuple[float, ...]  # as BETTER asks

    @property
    def hours(self) -> float:
        """How long it lasts."""
        return hours_of(self.frames, self.rate_hz)


@dataclass(frozen=True)
class ScannedSubject:
    """A subject as its files have it, and what of it is wanted."""

    subject: Subject
    who: ReleaseSubject
    trials: tuple[ScannedTrial, ...] = ()  # that are wanted
    left_out: tuple[LeftOut, ...] = ()

    @property
    def frames(self) -> int:
        """Of all wanted trials."""
        return sum(trial.frames for trial in self.trials)


def scan(
    roots: Sequence[Path], options: BuildOptions, progress: Callable[[str], None] = lambda _: None
) -> tuple[tuple[ScannedSubject, ...], tuple[LeftOut, ...]]:
    """All subjects of some folders, sorted by id, with what is wanted of them; and folders that are none.

    Args:
        roots: folders of subjects, or subjects.
        options: of the release.
        progress: told whose files are read.

    Raises:
        ReleaseError: two subjects would have one name.
        CaptureError: a root is missing, or holds no subject.
    """
    scanned: dict[str, ScannedSubject] = {}
    strange: list[LeftOut] = []
    shown = _Shown()
    for root in roots:
        found, notes = subjects_in(root)
        source = readable(root.resolve().name)
        for note in notes:
            place, _, why = note.partition(" is left out: ")
            strange.append(LeftOut("subject", f"{source}/{place}", "unreadable", why))
        for subject in found:
            who = release_subject(subject, options.terms, source)
            progress(who.subject_id)
            if who.subject_id in scanned:
                other = scanned[who.subject_id].subject
                raise ReleaseError(
                    f"two subjects are called {who.subject_id}: {_place(other)} and {_place(subject)}. "
                    "Rename one folder, or give them different sources in subject.toml, [release] source"
                )
            scanned[who.subject_id] = _scanned(subject, who, options, shown)
    in_order = [scanned[name] for name in sorted(scanned)]
    return tuple(_without_copies(in_order, shown.recordings)), tuple(strange)


def _place(subject: Subject) -> Path:
    return subject.recording or subject.folder


def _scanned(subject: Subject, who: ReleaseSubject, options: BuildOptions, shown: "_Shown") -> ScannedSubject:
    """The first reason that holds goes; one that is about the whole subject leaves its trials unread."""
    gate = _subject_gate(subject, who, options)
    if gate is not None:
        return ScannedSubject(subject, who, left_out=(gate,))
    left = [] if subject.static is None else [_of(who, readable(subject.static.stem), "static")]
    left += [
        _of(who, Path(file.file).with_suffix("").as_posix(), "not_listed", file.reason)
        for file in subject.unused
        if file.harm == MARKERS and (subject.static is None or subject.folder / file.file != subject.static)
    ]
    files, captures = [], []
    for trial in subject.trials:
        try:
            capture = read_trial(trial, _reading(subject), subject.mass_kg)
        except SolverError as error:
            left.append(_of(who, trial.name, "unreadable", str(error)))
        else:
            files.append(trial)
            captures.append(capture)
    try:
        labels = labels_of(subject, files, captures)
    except (ReviewError, SolverError) as error:
        return ScannedSubject(
            subject, who, left_out=(LeftOut("subject", who.subject_id, "unreadable", str(error)),)
        )
    kept = []
    for trial, capture in zip(files, captures, strict=True):
        said = labels[trial.name]
        own = _scanned_trial(subject, who, capture, finished=said.finished)
        reason = _trial_gate(capture, said, options)
        if reason is None:
            kept.append(own)
            shown.add(own.trial_id, subject, trial, capture.markers)
        else:
            left.append(_of(who, trial.name, reason, said.unusable, frames=own.frames, hours=own.hours))
    return ScannedSubject(subject, who, tuple(kept), tuple(left))


def _scanned_trial(
    subject: Subject, who: ReleaseSubject, capture: Capture, *, finished: bool
) -> ScannedTrial:
    markers = capture.markers
    worth = (
        float(finished),
        round(markers.frames / markers.rate, 1),
        round(markers.rate),
        round(max((plate.rate for plate in capture.plates), default=0.0)),
        float(subject.recording is None),
        float(np.isfinite(markers.positions_ground[..., 0]).sum()),
    )
    return ScannedTrial(capture.name, markers.frames, markers.rate, who.trial_id(capture.name), worth)


class _Shown:
    """What wanted trials show. Markers of the first are kept in memory, those of later ones read again."""

    def __init__(self) -> None:
        self.recordings: list[Recording] = []
        self._room = KEPT_BYTES

    def add(self, trial_id: str, subject: Subject, trial: TrialFiles, markers: Markers) -> None:
        """One more trial."""
        kept = replace(_places(markers), markers=markers.positions_ground.astype(np.float32))
        self._room -= kept.markers.nbytes
        room = self._room >= 0
        again = (lambda: kept) if room else partial(_places_again, subject, trial)
        labels = labels_without_names(markers.names)
        self.recordings.append(recording_of(trial_id, labels, _places(markers), again))


def _places_again(subject: Subject, trial: TrialFiles) -> Places:
    return _places(read_trial(trial, _reading(subject), subject.mass_kg).markers)


def _places(markers: Markers) -> Places:
    return Places(np.arange(markers.frames) / markers.rate, markers.positions_ground)


def _reading(subject: Subject) -> ReadingSettings:
    return settings_for(subject.folder).reading


def _subject_gate(subject: Subject, who: ReleaseSubject, options: BuildOptions) -> LeftOut | None:
    if options.leaves_out(who.person_id):
        return WITHDRAWN
    if who.licence is None:
        why = "add licence to [release] in its subject.toml, or give --licence"
        return LeftOut("subject", who.subject_id, "no_licence", why)
    if not is_spdx(who.licence):
        return LeftOut("subject", who.subject_id, "no_licence", NO_SPDX.format(who.licence))
    if who.consent != "public":
        return LeftOut("subject", who.subject_id, "no_consent", f"consent is {who.consent}")
    sides = sorted(str(side_of(body)) for body in subject.foot_bodies)
    if sides != ["l", "r"]:
        return LeftOut("subject", who.subject_id, "not_two_contact_bodies", ", ".join(subject.foot_bodies))
    return None


def _trial_gate(capture: Capture, said: TrialLabels, options: BuildOptions) -> str | None:
    if not capture.plates:
        return "no_forces"
    markers = capture.markers
    if grid_of(markers.frames, markers.rate, 0.0, options.rate_hz).frames < SHORTEST:
        return "too_short"
    if said.unusable:
        return "unusable"
    if not said.finished and not options.unreviewed:
        return "not_reviewed"
    return None


def _of(who: ReleaseSubject, name: str, reason: str, detail: str = "", **size: float) -> LeftOut:
    return LeftOut(
        "trial",
        who.trial_id(name),
        reason,
        detail,
        frames=int(size.get("frames", 0)),
        hours=size.get("hours", 0.0),
    )


@dataclass(frozen=True)
class _Copy:
    """A trial that shows the same as a better one."""

    of: ReleaseSubject
    trial_id: str  # of the better one
    why: str


def _without_copies(
    subjects: Sequence[ScannedSubject], recordings: Sequence[Recording]
) -> Iterator[ScannedSubject]:
    """The best of several recordings of the same stays; a subject all of whose trials are copies goes."""
    copies = _copies(subjects, recordings)
    for one in subjects:
        gone = {t.name: copies[t.trial_id] for t in one.trials if t.trial_id in copies}
        fresh = tuple(trial for trial in one.trials if trial.name not in gone)
        if gone and not fresh:
            of = ", ".join(sorted({copy.of.subject_id for copy in gone.values()}))
            why = f"same as {of}{next(iter(gone.values())).why}"
            hours = sum(trial.hours for trial in one.trials)
            row = LeftOut(
                "subject", one.who.subject_id, "duplicate_subject", why, frames=one.frames, hours=hours
            )
            yield replace(one, trials=(), left_out=(row,))
            continue
        left = list(one.left_out)
        for trial in one.trials:
            if (copy := gone.get(trial.name)) is not None:
                why = f"same as {copy.trial_id}{copy.why}"
                size = {"frames": trial.frames, "hours": trial.hours}
                left.append(_of(one.who, trial.name, "duplicate_trial", why, **size))
        if not fresh and not any(row.level == "subject" for row in left):
            left.append(LeftOut("subject", one.who.subject_id, "no_trials", "see its trials"))
        yield replace(one, trials=fresh, left_out=tuple(left))


def _copies(subjects: Sequence[ScannedSubject], recordings: Sequence[Recording]) -> dict[str, _Copy]:
    """By trial_id: those that go, since one that is better, or as good and before them by name, stays."""
    trials = {trial.trial_id: (trial, one.who) for one in subjects for trial in one.trials}
    alike: dict[str, list[str]] = {}
    for pair in same_recordings(recordings):
        for one, other in (pair, pair[::-1]):
            alike.setdefault(one.trial_id, []).append(other.trial_id)

    def rank(name: str) -> tuple[tuple[float, ...], str]:
        return tuple(-worth for worth in trials[name][0].worth), name

    kept: set[str] = set()
    copies = {}
    for name in sorted(alike, key=rank):
        of = min(kept & {*alike[name]}, key=rank, default=None)
        if of is None:
            kept.add(name)
        else:
            copies[name] = _Copy(trials[of][1], of, _why(*trials[of], *trials[name]))
    return copies


def _why(better: ScannedTrial, whose: ReleaseSubject, copy: ScannedTrial, other: ReleaseSubject) -> str:
    """What the better one has before the other, and whether two persons are said to have done it."""
    before = (
        f"; {words}" for words, mine, its in zip(BETTER, better.worth, copy.worth, strict=True) if mine > its
    )
    twice = "" if whose.person_id == other.person_id else "; they are called two persons"
    return next(before, "") + twice


def wanted_files(one: ScannedSubject) -> list[TrialFiles]:
    """Files of the trials that are wanted."""
    names = {trial.name for trial in one.trials}
    return [trial for trial in one.subject.trials if trial.name in names]


NOT_FITTED = "not fitted"
UNDECIDED = "detection left out frames about which nobody has decided"


@dataclass(frozen=True)
class TriageRow:
    """One trial; figures are None where there is no kept fit of it."""

    trial_id: str
    mass_kg: float | None = None
    mass_entered_kg: float | None = None
    linear_rms_bw: float | None = None
    angular_rms_bwh: float | None = None
    concerns: tuple[str, ...] = ()


def triaged(one: ScannedSubject) -> Iterator[TriageRow]:
    """All trials of a subject, whether they are taken or not, as its kept fit and diagnosis have them."""
    entered = one.subject.mass_kg
    file = default_folder(one.subject.folder) / "fit.json"
    try:
        figures = read_summary(file) if file.is_file() else None
        causes = named_causes(one.subject)
        for trial in one.subject.trials:
            trial_id, found = one.who.trial_id(trial.name), figures and figures.trial(trial.name)
            if figures is None or found is None:
                yield TriageRow(trial_id, mass_entered_kg=entered, concerns=(NOT_FITTED,))
                continue
            undecided = (UNDECIDED,) if DETECTION in found.masks else ()
            yield TriageRow(
                trial_id,
                figures.subject.mass_kg,
                entered,
                found.force_BW,
                found.moment_BWh,
                (*undecided, *concerns_of(trial.name, figures.notes, causes)),
            )
    except (SolverError, ValueError, KeyError, TypeError, AttributeError, OSError) as error:
        yield TriageRow(one.who.subject_id, mass_entered_kg=entered, concerns=(f"{file}: {error}",))


def concerns_of(trial: str, notes: Iterable[Note], causes: Sequence[Cause]) -> tuple[str, ...]:
    """What somebody should look at: causes that the diagnosis named, then notes of the fit that ask for it.

    Args:
        trial: its name.
        notes: of the fit.
        causes: of the diagnosis.
    """
    named = [
        f"{f'{cause.id} {cause.target}'.strip()} ({100 * cause.confidence:.0f} %)"
        for cause in causes
        if cause.trial in (None, trial)
    ]
    own = by_kind([note for note in notes if note.trial == trial])
    said = [found.key_findings.removeprefix(f"{trial}: ") for found in own if found.needs_decision]
    return (*named, *said)
