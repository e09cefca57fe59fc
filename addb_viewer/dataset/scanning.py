"""What there is, before anything is fitted: subjects, trials, and which of them a release takes."""

import hashlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from addb_viewer.dataset.errors import ReleaseError
from addb_viewer.dataset.grid import grid_of
from addb_viewer.dataset.identifiers import side_of
from addb_viewer.dataset.left_out import LeftOut, hours_of
from addb_viewer.dataset.options import BuildOptions
from addb_viewer.dataset.release_subject import ReleaseSubject, release_subject
from addb_viewer.dataset.segments import SHORTEST
from addb_viewer.dataset.trial_labels import labels_of
from annotations.errors import ReviewError
from solver.capture.capture import Capture, Markers, Subject, TrialFiles
from solver.capture.subject import subjects_in
from solver.capture.trial import read_trial
from solver.errors import SolverError
from solver.settings import settings_for

ROUNDING_M = 1e-4  # [m] that markers are rounded to before two recordings are compared


@dataclass(frozen=True)
class ScannedTrial:
    """A trial as its files have it."""

    name: str
    frames: int
    rate_hz: float
    content: str  # SHA-256 of its markers, in any place and under any names

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
    for root in roots:
        found, notes = subjects_in(root, settings_of=lambda folder: settings_for(folder).reading)
        for note in notes:
            place, _, why = note.partition(" is left out: ")
            strange.append(LeftOut("subject", f"{root.resolve().name}/{place}", "unreadable", why))
        for subject in found:
            who = release_subject(subject, options.terms, root.resolve().name)
            progress(who.subject_id)
            if who.subject_id in scanned:
                other = scanned[who.subject_id].subject
                raise ReleaseError(
                    f"two subjects are called {who.subject_id}: {_place(other)} and {_place(subject)}. "
                    "Rename one folder, or give them different sources in subject.toml, [release] source"
                )
            scanned[who.subject_id] = _scanned(subject, who, options)
    in_order = [scanned[name] for name in sorted(scanned)]
    return tuple(_without_copies(in_order)), tuple(strange)


def _place(subject: Subject) -> Path:
    return subject.recording or subject.folder


def _scanned(subject: Subject, who: ReleaseSubject, options: BuildOptions) -> ScannedSubject:
    """The first reason that holds goes; one that is about the whole subject leaves its trials unread."""
    gate = _subject_gate(subject, who, options)
    if gate is not None:
        return ScannedSubject(subject, who, left_out=(gate,))
    left = [] if subject.static is None else [_of(who, subject.static.stem, "static")]
    files, captures = [], []
    for trial in subject.trials:
        try:
            capture = read_trial(trial, settings_for(subject.folder).reading, subject.mass_kg)
        except SolverError as error:
            left.append(_of(who, trial.name, "unreadable", str(error)))
        else:
            files.append(trial)
            captures.append(capture)
    try:
        finished = {name: labels.finished for name, labels in labels_of(subject, files, captures).items()}
    except (ReviewError, SolverError) as error:
        return ScannedSubject(
            subject, who, left_out=(LeftOut("subject", who.subject_id, "unreadable", str(error)),)
        )
    kept = []
    for trial, capture in zip(files, captures, strict=True):
        own = ScannedTrial(
            trial.name, capture.markers.frames, capture.markers.rate, content_of(capture.markers)
        )
        reason = _trial_gate(capture, finished[trial.name], options)
        if reason is None:
            kept.append(own)
        else:
            left.append(_of(who, trial.name, reason, frames=own.frames, hours=own.hours))
    return ScannedSubject(subject, who, tuple(kept), tuple(left))


def _subject_gate(subject: Subject, who: ReleaseSubject, options: BuildOptions) -> LeftOut | None:
    if who.person_id in options.without:
        return LeftOut("subject", "withdrawn", "withdrawn")
    if who.licence is None:
        why = "add licence to [release] in its subject.toml, or give --licence"
        return LeftOut("subject", who.subject_id, "no_licence", why)
    if who.consent != "public":
        return LeftOut("subject", who.subject_id, "no_consent", f"consent is {who.consent}")
    sides = sorted(str(side_of(body)) for body in subject.foot_bodies)
    if sides != ["l", "r"]:
        return LeftOut("subject", who.subject_id, "not_two_contact_bodies", ", ".join(subject.foot_bodies))
    return None


def _trial_gate(capture: Capture, finished: bool, options: BuildOptions) -> str | None:
    if not capture.plates:
        return "no_forces"
    markers = capture.markers
    if grid_of(markers.frames, markers.rate, 0.0, options.rate_hz).frames < SHORTEST:
        return "too_short"
    if not finished and not options.unreviewed:
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


def content_of(markers: Markers) -> str:
    """SHA-256 of a recording's markers about their middle, rounded to 0.1 mm; names do not enter."""
    positions = markers.positions_ground
    middle = np.nanmean(positions.reshape(-1, 3), axis=0) if np.isfinite(positions).any() else np.zeros(3)
    rounded = np.round((positions - middle) / ROUNDING_M)
    whole = np.where(np.isfinite(rounded), rounded, -(2**31)).astype("<i4")
    courses = sorted(np.ascontiguousarray(whole[:, k]).tobytes() for k in range(whole.shape[1]))
    return hashlib.sha256(b"".join(courses)).hexdigest()


def _without_copies(subjects: Sequence[ScannedSubject]) -> Iterator[ScannedSubject]:
    """The first of several equal recordings stays; a subject all of whose trials are copies goes."""
    seen: dict[str, str] = {}
    for one in subjects:
        copies: dict[str, str] = {}
        fresh: list[ScannedTrial] = []
        for trial in one.trials:
            if trial.content in seen:
                copies[trial.name] = seen[trial.content]
                continue
            seen[trial.content] = one.who.trial_id(trial.name)
            fresh.append(trial)
        if one.trials and not fresh:
            of = next(iter(copies.values())).rsplit("/", 1)[0]
            gone = LeftOut(
                "subject",
                one.who.subject_id,
                "duplicate_subject",
                f"same as {of}",
                frames=one.frames,
                hours=sum(trial.hours for trial in one.trials),
            )
            yield replace(one, trials=(), left_out=(gone,))
            continue
        rows = [
            _of(
                one.who,
                t.name,
                "duplicate_trial",
                f"same as {copies[t.name]}",
                frames=t.frames,
                hours=t.hours,
            )
            for t in one.trials
            if t.name in copies
        ]
        left = (*one.left_out, *rows)
        subject_level = any(row.level == "subject" for row in left)
        if not fresh and not subject_level:
            left = (*left, LeftOut("subject", one.who.subject_id, "no_trials", "see its trials"))
        yield replace(one, trials=tuple(fresh), left_out=left)


def wanted_files(one: ScannedSubject) -> list[TrialFiles]:
    """Files of the trials that are wanted."""
    names = {trial.name for trial in one.trials}
    return [trial for trial in one.subject.trials if trial.name in names]
