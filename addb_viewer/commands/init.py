"""`addb-viewer init`: a subject.toml that says what was understood of a folder."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from addb_viewer.commands.options import Debug
from addb_viewer.jobs.errors import errors_as_lines
from addb_viewer.jobs.subject_checks import check_folder
from solver.capture.atomic import write_whole
from solver.capture.capture import Subject
from solver.capture.formats.b3d.places import subject_folder_of
from solver.capture.formats.text_table import some_of
from solver.capture.subject.same_motion import markers_of
from solver.capture.subject.subject import subjects_in
from solver.capture.subject.subject_layout import DESCRIBED_BY_HAND
from solver.capture.subject.subject_toml_writing import described_as_toml
from solver.capture.trial import read_static, read_trial
from solver.common.errors import CaptureError
from solver.fitting.settings import settings_for
from solver.markers.people import subjects_among

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
        subjects, notes = _subjects(folder, recursive)
        said: frozenset[str] = frozenset()
        for subject in subjects:
            for one in (subject,) if subject.is_described else subjects_among(subject):
                file = _file(one.folder)
                if not file.exists():
                    said = _describe(one, said)
                elif recursive:
                    typer.echo(f"{file}: there already; left as it is")
                else:
                    raise CaptureError(
                        f"{file}: there already, and never written over. Correct it, or move it away."
                    )
        for note in notes:
            typer.echo(f"note: {note}")


def _subjects(folder: Path, recursive: bool) -> tuple[Sequence[Subject], Sequence[str]]:
    """The subject of a folder, or the only one in it; all of them where they are asked for."""
    found, notes = subjects_in(folder, settings_of=lambda place: settings_for(place).reading)
    if len(found) > 1 and not recursive:
        names = some_of([subject.folder.relative_to(folder).as_posix() for subject in found])
        raise CaptureError(f"{folder}: {len(found)} subjects: {names}. Give one of them, or add --recursive.")
    return found, notes


def _file(folder: Path) -> Path:
    return folder / DESCRIBED_BY_HAND


def _describe(subject: Subject, said: frozenset[str]) -> frozenset[str]:
    """Write one, and print what was not said yet."""
    subject.folder.mkdir(exist_ok=True)
    named = {trial.name: trial.markers for trial in subject.trials}
    if subject.static is not None:
        named[f"{subject.static.stem} (static)"] = subject.static
    damaged = [name for name, path in named.items() if markers_of(path) is None and path != subject.recording]
    subject = replace(subject, notes=(*_why_unread(subject, damaged), *subject.notes))
    write_whole(_file(subject.folder), described_as_toml(subject))
    forces = sum(trial.forces is not None for trial in subject.trials)
    inside = sum(trial.forces is None and trial.markers.suffix.lower() == ".c3d" for trial in subject.trials)
    trials = f"{len(subject.trials)} trial{'s' * (len(subject.trials) != 1)}"
    in_c3d = f", {inside} in C3D files, which may hold forces themselves" if inside else ""
    found = f"{trials}, {forces} with a force file{in_c3d}"
    if subject.static is not None:
        found += f"; static trial {subject.static.name}"
    found += f"; {len(subject.unused)} files not used"
    if damaged:
        found += f"; cannot be read: {', '.join(damaged)}"
    typer.echo(f"{_file(subject.folder)}: {found}")
    for note in subject.notes:
        if note not in said:
            typer.echo(f"note: {note}")
    return said | {*subject.notes}


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
            read_static(subject.static, reading, subject.prefix)
        except CaptureError as error:
            yield f"static trial: a fit will leave it out: {error}"
