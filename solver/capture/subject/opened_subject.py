"""A subject's folder, in AddBiomechanics' layout, with a subject.toml, or with files side by side."""

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from solver.capture.capture import Capture, Subject, TrialFiles, UnreadTrial, UnusedFile
from solver.capture.formats.b3d.b3d_subject import open_b3d_subject
from solver.capture.formats.b3d.places import is_b3d, recording_of, subject_folder_of
from solver.capture.formats.qtm_tsv import force_files
from solver.capture.formats.recording_files import is_recording
from solver.capture.formats.text_table import some_of, unique_names
from solver.capture.subject.description import Description, stated_by
from solver.capture.subject.loose_files import (
    FoundTrials,
    files_in,
    find_models,
    read_subject_json,
    trials_among,
    trials_of,
)
from solver.capture.subject.measured_files import listed_in
from solver.capture.subject.review import with_ranges
from solver.capture.subject.subject_layout import (
    DEEPEST,
    DESCRIBED_BY_HAND,
    DESCRIPTIONS,
    Layout,
    folders_below,
    layout_of,
)
from solver.capture.subject.subject_toml import read_subject_toml
from solver.capture.subject.unused_files import FORCES, MARKERS, read_with, unused_files, what_lies_in
from solver.capture.trial import READING, ReadingSettings, read_static, read_trial
from solver.common.errors import CaptureError, SolverError
from solver.common.file_names import readable
from solver.common.notes import Kind, Note, noted
from solver.common.small_files import BrokenFileError, lies_there

LISTED = 5  # folders in a message
MARKER_MAP = "markers.toml"  # in the subject's folder: what its labels mean


class NoSubjectError(CaptureError):
    """Nobody's recordings lie in a folder, or below it."""


class SharedFolderError(CaptureError):
    """The recordings of a folder are those of several people, each with a folder in it."""

    def __init__(self, folder: Path, people: list[str], shared: list[Path], left: list[str]) -> None:
        """Said of the folder; what no one has is told.

        Args:
            folder: of all.
            people: names of the folders whose subject.toml names files beside them.
            shared: the folder, and those in it that hold such files.
            left: recordings there that none of them names.
        """
        self.shared = shared
        self.left = (
            f"in no subject.toml: {some_of(left, LISTED)}; name each in that of its person" if left else ""
        )
        super().__init__(
            f"{folder}: its recordings are those of {', '.join(people)}, by the subject.toml of each. Give "
            f"one of these folders. {self.left}".strip()
        )


def open_subject(folder: Path, *, awaits: bool = False) -> Subject:
    """Find out who was recorded, with which model, in which trials. Files are read where names do not say.

    A subject.toml says it all; _subject.json fills in what it leaves out; where neither names trials, they
    are looked for in trials/NAME/, else among the files of the folder and of those below it that are the
    subject's. What is not used is listed.

    Args:
        folder: of the subject; or a .b3d file, or the folder of decisions beside one.
        awaits: whether files that a subject.toml names may still be to come: `Subject.awaited`.

    Raises:
        CaptureError: no such folder, no trial in it, or a description that is broken or names missing files.
    """
    folder = subject_folder_of(Path(folder))
    recording = recording_of(folder)
    if recording is not None:
        return open_b3d_subject(folder, recording)
    if not folder.is_dir():
        remedy = (
            f"Give its folder: {folder.parent}." if folder.is_file() else "Check the spelling of the path."
        )
        raise CaptureError(f"{folder}: no folder of that name. {remedy}")
    described, awaited = Description(), list[Path]()
    by_hand, uploaded, marker_map = (
        folder / name for name in (DESCRIBED_BY_HAND, "_subject.json", MARKER_MAP)
    )
    try:
        has_map = _lies_there(marker_map)
        if _lies_there(by_hand):
            described = described.or_else(read_subject_toml(by_hand, awaited=awaited if awaits else None))
        if _lies_there(uploaded):
            described = described.or_else(read_subject_json(uploaded))
        layout, found = Layout((folder,), {}), FoundTrials((), None, (), {})
        if described.trials is None:
            layout, found = _found(folder)
            described = described.or_else(
                Description(
                    trials=found.trials or None, static=found.static, notes=layout.notes + found.notes
                )
            )
        models = [] if by_hand.is_file() else find_models(folder)
        model = described.model or (models[0] if len(models) == 1 else None)
        if described.trials is None:
            raise CaptureError(f"{folder}: no trials. {_what_was_sought(folder, layout)}")
        recordings = (described.static, *(path for t in described.trials for path in (t.markers, t.forces)))
        described = described.or_else(
            stated_by(dict.fromkeys(path for path in recordings if path), described)
        )
        assert described.trials is not None
        trials, range_notes = with_ranges(described.trials, described.ranges)
        left = dict(found.left)
        if len(models) > 1:
            left |= dict.fromkeys(models, _which_model(folder, models))
        subject = Subject(
            folder=folder,
            trials=tuple(replace(trial, prefix=described.prefix) for trial in trials),
            mass_kg=described.counted_kg,
            scale_factor=described.scale_factor,
            height_m=described.height_m,
            sex=described.sex,
            age_years=described.age_years,
            model=model,
            model_is=described.model_is,
            static=described.static,
            marker_map=marker_map if has_map else None,
            foot_bodies=described.foot_bodies or Subject.foot_bodies,
            tags=described.tags or (),
            release=described.release,
            prefix=described.prefix,
            other_statics=found.other_statics,
            plan=described.plan or (),
            awaited=tuple(awaited),
            is_described=any(map(_lies_there, (by_hand, uploaded))),
            notes=_readable(
                *described.notes, *range_notes, *_model_notes(folder, model, models, by_hand.is_file())
            ),
        )
        silent = "subject.toml does not name it" if by_hand.is_file() and not found.trials else ""
        unused = unused_files(folder, _used(subject), left, layout.others, silent)
    except PermissionError as error:
        raise CaptureError(f"{error.filename}: cannot be read ({error.strerror}).") from error
    shown = (replace(one, file=readable(one.file), reason=readable(one.reason)) for one in unused)
    return replace(subject, unused=tuple(shown))


def subjects_in(
    folder: Path, deepest: int = DEEPEST, may_be_read: Callable[[Path], None] | None = None
) -> tuple[tuple[Subject, ...], tuple[str, ...]]:
    """The subjects of a folder: itself, if it is one, else those below it; and why others are left out.

    Args:
        folder: to look into.
        deepest: folders below it that are looked into.
        may_be_read: raises CaptureError of a folder of which no file may be read; asked before any is.

    Raises:
        NoSubjectError: neither it nor any folder below is a subject's.
        CaptureError: no such folder, or none of its subjects can be read.
    """
    is_allowed = False
    try:
        if may_be_read is not None and folder.is_dir():
            may_be_read(folder)
        is_allowed = True
        return (open_subject(folder),), ()
    except CaptureError as error:
        described = not folder.is_dir() or any((folder / name).is_file() for name in DESCRIPTIONS)
        if described or (not is_allowed and _holds_trials(folder)):
            raise
        alone = error
    found, notes = _b3d_subjects(folder, may_be_read)
    if isinstance(alone, SharedFolderError) and alone.left:
        notes.append(readable(alone.left))
    broken = list(notes)
    shared = alone.shared if isinstance(alone, SharedFolderError) else []
    for place in folders_below(folder, 1) if deepest else ():
        if place in shared:
            continue
        try:
            subjects, more = subjects_in(place, deepest - 1, may_be_read)
        except CaptureError as error:
            notes.append(readable(f"{place.name} is left out: {error}"))
            broken += [] if isinstance(error, NoSubjectError) else notes[-1:]
        else:
            found += subjects
            notes += (readable(f"{place.name}/{note}") for note in more)
    if not found and broken:
        raise CaptureError(f"{folder}: no subject in it can be read. {' '.join(broken[:LISTED])}")
    if not found:
        raise NoSubjectError(f"{alone} Nor is any folder in it a subject's.")
    return tuple(found), tuple(notes)


def _b3d_subjects(
    folder: Path, may_be_read: Callable[[Path], None] | None
) -> tuple[list[Subject], list[str]]:
    """The .b3d files of a folder, each a subject; and why others are left out."""
    found: list[Subject] = []
    notes: list[str] = []
    for file in files_in(folder):
        if not is_b3d(file):
            continue
        try:
            if may_be_read is not None:
                may_be_read(subject_folder_of(file))
            found.append(open_subject(file))
        except CaptureError as error:
            notes.append(readable(f"{file.name} is left out: {error}"))
    return found, notes


def _lies_there(path: Path) -> bool:
    try:
        return lies_there(path)
    except BrokenFileError as error:
        raise CaptureError(f"{path}: {error}") from error


def _holds_trials(folder: Path) -> bool:
    """Whether a folder is a subject's by the names in it; nothing is read."""
    return (folder / "trials").is_dir() or any(map(is_recording, files_in(folder)))


def _found(folder: Path) -> tuple[Layout, FoundTrials]:
    if (folder / "trials").is_dir():
        in_trials = trials_of(folder / "trials")
        if in_trials.trials:
            return Layout((folder,), {}), _named(in_trials)
    _refuse_shared(folder)
    layout = layout_of(folder)
    return layout, _named(trials_among(folder, layout.places))


def _refuse_shared(folder: Path) -> None:
    """Raise where folders in it name recordings that lie beside them, each those of one person."""
    people, named = [], set[Path]()
    places = list(folders_below(folder, 1))
    for place in places:
        beside = [p for p in listed_in(place / DESCRIBED_BY_HAND) if not p.is_relative_to(place.resolve())]
        people += [place.name] if beside else []
        named.update(beside)
    if people:
        shared = [p for p in places if any(one.is_relative_to(p.resolve()) for one in named)]
        left = [
            p.relative_to(folder).as_posix()
            for place in (folder, *shared, *(below for kind in shared for below in folders_below(kind)))
            for p in files_in(place)
            if is_recording(p) and p.resolve() not in named
        ]
        raise SharedFolderError(folder, people, shared, left)


def _named(found: FoundTrials) -> FoundTrials:
    """Trials called as a subject.toml and a review can call them, each by a name of its own."""
    plain = [readable(trial.name).replace("\\", "_").strip().lstrip(".") or "trial" for trial in found.trials]
    names = unique_names(plain)[0]
    trials = (replace(trial, name=name) for trial, name in zip(found.trials, names, strict=True))
    return replace(found, trials=tuple(trials))


def _readable(*notes: Note) -> tuple[Note, ...]:
    return tuple(note.reworded(readable) for note in notes)


def _used(subject: Subject) -> Iterator[Path]:
    yield from (p for p in (subject.model, subject.static, subject.marker_map) if p is not None)
    for trial in subject.trials:
        yield trial.markers
        if trial.forces is not None:
            yield from force_files(trial.forces)
        yield from read_with(trial.reviews)


def _model_notes(folder: Path, model: Path | None, models: list[Path], by_hand: bool) -> tuple[Note, ...]:
    if len(models) > 1:
        return noted(Kind.OTHER, f"{', '.join(p.name for p in models)}: {_which_model(folder, models)}")
    unused = [p.name for p in files_in(folder) if p.suffix.lower() == ".osim"]
    if model is None and by_hand and unused:
        return noted(
            Kind.MODEL_AGAINST_MARKERS,
            f"subject.toml names no model: {', '.join(unused)} not used; the default body is used",
        )
    return ()


def _which_model(folder: Path, models: list[Path]) -> str:
    return (
        "several models, and nothing says which to use, so the default body is used; name one in "
        f'subject.toml, as in model = "{models[0].relative_to(folder).as_posix()}"'
    )


def _what_was_sought(folder: Path, layout: Layout) -> str:
    """Where trials may lie, and what lies here instead."""
    people = [f"{place.relative_to(folder).as_posix()} ({why})" for place, why in layout.others.items()]
    below = sum(is_recording(p) and p.parent != folder for p in folder.rglob("*"))
    found = f" {below} marker files lie elsewhere in it." if below else ""
    if people:
        more = f" and {len(people) - LISTED} more" if len(people) > LISTED else ""
        found += (
            f" Folders in it: {', '.join(people[:LISTED])}{more}. Give one of them, or write a subject.toml."
        )
    return (
        "Put files into trials/NAME/markers.trc, or X.trc beside X_grf.mot, or X.c3d, or name them in a "
        f"subject.toml.{found}{what_lies_in(folder)}"
    )


@dataclass(frozen=True)
class ReadTrials:
    """What could be read of a subject, and what could not."""

    captures: list[Capture]
    static: Capture | None
    unread: tuple[UnreadTrial, ...] = ()

    @property
    def notes(self) -> tuple[Note, ...]:
        """A sentence on each trial that is left out."""
        return tuple(
            Note(
                Kind.NOT_READ,
                f"left out, {trial.file.file} cannot be used: {trial.file.reason}",
                trial=trial.name,
            )
            if trial.name
            else Note(
                Kind.NOT_READ,
                f"static trial: left out, so the trials alone scale the body; {trial.file.file} cannot be "
                f"used: {trial.file.reason}",
            )
            for trial in self.unread
        )


def read_trials(
    subject: Subject,
    trials: Sequence[TrialFiles],
    settings: ReadingSettings = READING,
    *,
    instead: Mapping[str, Capture] | None = None,
    progress: Callable[[str], None] | None = None,
) -> ReadTrials:
    """Read trials and the subject's static trial, without those that cannot be read.

    Args:
        subject: as `open_subject` found it.
        trials: those wanted.
        settings: thresholds.
        instead: recordings in place of those that the files hold, by trial.
        progress: told the name of each trial before it is read.

    Raises:
        CaptureError: none of the trials can be read.
    """
    captures, errors = [], {}
    for files in trials:
        if progress is not None:
            progress(files.name)
        try:
            given = (instead or {}).get(files.name)
            captures.append(given or read_trial(files, settings, subject.mass_kg))
        except CaptureError as error:
            errors[files.name] = error
        except (ArithmeticError, LookupError, TypeError, ValueError) as error:
            said = f"{files.markers}: reading breaks down ({type(error).__name__}: {error}). Export it again."
            errors[files.name] = CaptureError(said)
    if not captures:
        first = next(iter(errors.values()), None)
        others = f" Nor can any of the {len(errors) - 1} other trials be read." if len(errors) > 1 else ""
        raise CaptureError(f"{first or f'{subject.folder}: no trials.'}{others}")
    unread = [
        UnreadTrial(files.name, unused(errors[files.name], subject, files.markers, files.forces))
        for files in trials
        if files.name in errors
    ]
    static = None
    if subject.static is not None:
        try:
            static = read_static(subject.static, settings, subject.prefix)
        except CaptureError as error:
            unread.append(UnreadTrial("", unused(error, subject, subject.static, None)))
    return ReadTrials(captures, static, tuple(unread))


def unused(error: SolverError, subject: Subject, markers: Path, forces: Path | None) -> UnusedFile:
    """The file that an error is about, from the subject's folder, and the reason without its path."""
    text = str(error)
    about = forces if forces is not None and text.startswith(str(forces)) else markers
    file, reason = Path(os.path.relpath(about, subject.folder)).as_posix(), text.removeprefix(f"{about}: ")
    return UnusedFile(readable(file), readable(reason), MARKERS if about == markers else FORCES)
