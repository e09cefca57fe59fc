"""`addb-viewer init`: a subject.toml that says what was understood of a folder."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from addb_viewer.commands.errors import errors_as_lines
from addb_viewer.commands.options import Debug
from addb_viewer.jobs.subject_checks import check_folder
from solver.capture.atomic import write_whole
from solver.capture.b3d.places import subject_folder_of
from solver.capture.capture import Subject
from solver.capture.same_motion import markers_of
from solver.capture.subject import open_subject, subjects_in
from solver.capture.subject_layout import DESCRIBED_BY_HAND
from solver.capture.subject_toml_writing import described_as_toml
from solver.capture.trial import read_static, read_trial
from solver.errors import CaptureError
from solver.markers.people import people_notes
from solver.settings import settings_for

Folder = Annotated[
    Path,
    typer.Argument(
        metavar="FOLDER",
        help="Folder of the recordings, or of several subjects; or a .b3d file.",
        callback=subject_folder_of,
    ),
]
Recursive = Annotated[
    bool, typer.Option("--recursive", help="One for each subject in the folder, however deep.")
]


def init(folder: Folder, recursive: Recursive = False, debug: Debug = False) -> None:
    """Write a subject.toml that says what was understood, commented, for you to correct.

    One that is there already is never written over.
    """
    with errors_as_lines(debug):
        check_folder(folder)
        if not recursive:
            _refuse_existing(folder)
            _describe(open_subject(folder, settings_for(folder).reading))
            return
        subjects, notes = subjects_in(folder, settings_of=lambda place: settings_for(place).reading)
        for subject in subjects:
            if _file(subject.folder).exists():
                typer.echo(f"{_file(subject.folder)}: there already; left as it is")
            else:
                _describe(subject)
        for note in notes:
            typer.echo(f"note: {note}")


def _file(folder: Path) -> Path:
    return folder / DESCRIBED_BY_HAND


def _refuse_existing(folder: Path) -> None:
    if _file(folder).exists():
        raise CaptureError(
            f"{_file(folder)}: there already, and never written over. Correct it, or move it away."
        )


def _describe(subject: Subject) -> None:
    named = {trial.name: trial.markers for trial in subject.trials}
    if subject.static is not None:
        named[f"{subject.static.stem} (static)"] = subject.static
    read = {name: markers for name, path in named.items() if (markers := markers_of(path)) is not None}
    damaged = [name for name in named if name not in read and named[name] != subject.recording]
    subject = replace(subject, notes=(*people_notes(read), *_why_unread(subject, damaged), *subject.notes))
    write_whole(_file(subject.folder), described_as_toml(subject))
    forces = sum(trial.forces is not None for trial in subject.trials)
    inside = sum(trial.forces is None and trial.markers.suffix.lower() == ".c3d" for trial in subject.trials)
    trials = f"{len(subject.trials)} trial{'s' * (len(subject.trials) != 1)}"
    in_c3d = f", {inside} in C3D files, which may hold forces themselves" if inside else ""
    said = f"{trials}, {forces} with a force file{in_c3d}; {len(subject.unused)} files not used"
    if damaged:
        said += f"; cannot be read: {', '.join(damaged)}"
    typer.echo(f"{_file(subject.folder)}: {said}")
    for note in subject.notes:
        typer.echo(f"note: {note}")


def _why_unread(subject: Subject, damaged: list[str]) -> Iterator[str]:
    reading = settings_for(subject.folder).reading
    for trial in subject.trials:
        if trial.name in damaged:
            try:
                read_trial(trial, reading)
            except CaptureError as error:
                yield f"{trial.name}: a fit will leave it out: {error}"
    if subject.static is not None and f"{subject.static.stem} (static)" in damaged:
        try:
            read_static(subject.static, reading)
        except CaptureError as error:
            yield f"static trial: a fit will leave it out: {error}"
