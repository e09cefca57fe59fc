"""All wanted trials of a subject that can be read; one that cannot is told, and takes no other with it."""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from solver.capture.capture import Capture, Subject, TrialFiles, UnreadTrial, UnusedFile
from solver.capture.reading_settings import READING, ReadingSettings
from solver.capture.subject.unused_files import FORCES, MARKERS
from solver.capture.trial import read_static, read_trial
from solver.common.errors import CaptureError, SolverError
from solver.common.file_names import readable
from solver.common.notes import Kind, Note


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
