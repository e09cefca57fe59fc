"""`addb-viewer init`, `markers` and `settings`: how a subject is understood, in files to correct."""

import shlex
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer
from rich import box
from rich.table import Table

from addb_viewer.commands.options import Debug, JsonFile, MapFile, SettingsFile, optional_subject_folder
from addb_viewer.jobs.command_errors import check_folder, errors_as_lines
from addb_viewer.text.summary_table import console
from solver.capture.atomic import write_whole
from solver.capture.capture import Markers, Subject
from solver.capture.formats.b3d.places import subject_folder_of
from solver.capture.formats.text_table import some_of
from solver.capture.subject.opened_subject import MARKER_MAP, open_subject, read_trials, subjects_in
from solver.capture.subject.same_motion import markers_of
from solver.capture.subject.subject_layout import DESCRIBED_BY_HAND
from solver.capture.subject.subject_toml import described_as_toml
from solver.capture.trial import read_static, read_trial
from solver.common.errors import CaptureError
from solver.common.notes import Kind, Note
from solver.fitting.results.store import write_json
from solver.fitting.settings import Settings, as_toml, read_settings, settings_for
from solver.kinematics.label_reading import read_labels
from solver.kinematics.marker_naming import checked_map, strangers
from solver.kinematics.own_model_naming import is_bare, own_names
from solver.markers.atlas import atlas
from solver.markers.mapping_file import read_map, remark, write_map
from solver.markers.person_count import subjects_among
from solver.markers.understanding import Understanding, UnderstoodLabel, understand
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.skeleton import Skeleton
from solver.skeleton.subject_model import load_subject_model

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
        typer.echo(f"next: look at subject.toml, then addb-viewer fit {shlex.quote(str(folder))}")


def _subjects(folder: Path, recursive: bool) -> tuple[Sequence[Subject], Sequence[str]]:
    """The subject of a folder, or the only one in it; all of them where they are asked for."""
    found, notes = subjects_in(folder)
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
    with_forces = [f"{forces} with a force file"] if forces or not inside else []
    with_forces += [f"{inside} in C3D files, which may hold forces themselves"] if inside else []
    found = ", ".join([trials, *with_forces])
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


def _why_unread(subject: Subject, damaged: list[str]) -> Iterator[Note]:
    reading = settings_for(subject.folder).reading
    for trial in subject.trials:
        if trial.name in damaged:
            try:
                read_trial(trial, reading)
            except CaptureError as error:
                yield Note(Kind.NOT_READ, f"a fit will leave it out: {error}", trial=trial.name)
    if subject.static is not None and f"{subject.static.stem} (static)" in damaged:
        try:
            read_static(subject.static, reading, subject.prefix)
        except CaptureError as error:
            yield Note(Kind.NOT_READ, f"static trial: a fit will leave it out: {error}")


WIDTH_OF_A_PIPE = 250  # [characters] where no terminal says how wide it is

OptionalSubject = Annotated[
    Path | None,
    typer.Argument(
        metavar="SUBJECT",
        help="Folder of the recordings; or a .b3d file.",
        show_default=False,
        callback=optional_subject_folder,
    ),
]
DryRun = Annotated[bool, typer.Option("--no-write", help="Print only; leave the map as it is.")]
Landmarks = Annotated[
    bool,
    typer.Option("--landmarks", help="List the landmarks that a map may name, and stop.", is_eager=True),
]


def markers(
    subject: OptionalSubject = None,
    map_: MapFile = None,
    no_write: DryRun = False,
    landmarks: Landmarks = False,
    settings: SettingsFile = None,
    json: JsonFile = None,
    debug: Debug = False,
) -> None:
    """Print how each label is understood, how sure that is, and write a map that you can correct.

    What you wrote into the map stays, whatever the labels look like.
    """
    if landmarks:
        _print_landmarks()
        return
    if subject is None:
        raise typer.BadParameter("give the folder of the recordings", param_hint="SUBJECT")
    with errors_as_lines(debug):
        check_folder(subject)
        chosen = settings_for(subject, settings)
        who = open_subject(subject)
        recordings = _recordings(who, chosen)
        model = None if who.model is None else load_subject_model(who.model)
        on_model = None if model is None or is_bare(model) else own_names(model, recordings)
        understood = _understood(recordings, on_model, chosen)
        file = map_ or subject / MARKER_MAP
        written = read_map(file) if file.is_file() else {}
        notes = _checked(written, model, recordings)
        kept = _corrected(written, understood, on_model)
        if json is not None:
            write_json(json, _figures(understood, kept))
        _print(understood, kept)
        for note in notes:
            typer.echo(f"note: {note}")
        if not no_write:
            write_map(file, understood, kept, on_model)
            typer.echo(f"{file}: correct it, then fit again")


def _understood(
    recordings: Sequence[Markers], on_model: dict[str, str] | None, settings: Settings
) -> Understanding:
    """By name; without a marker set of the subject's own, also by the motion where names say nothing."""
    if on_model is None:
        return read_labels(default_skeleton(), recordings, settings=settings.kinematics).understanding
    return understand([name for m in recordings for name in m.names], recordings)


def _recordings(subject: Subject, settings: Settings) -> list[Markers]:
    read = read_trials(subject, subject.trials, settings.reading)
    for note in read.notes:
        typer.echo(f"note: {note}")
    return [capture.markers for capture in (*read.captures, *([read.static] if read.static else []))]


def _checked(
    written: dict[str, str], model: Skeleton | None, recordings: Sequence[Markers]
) -> tuple[str, ...]:
    """Notes on a map that a fit would make as well; what a fit would refuse is refused here."""
    word = checked_map(written, model or default_skeleton(), recordings, default_body=model is None)
    return strangers(word, {name for m in recordings for name in m.names})


def _corrected(
    written: dict[str, str], understood: Understanding, on_model: dict[str, str] | None
) -> dict[str, str]:
    """Lines of an existing map that say something else than the labels do by themselves."""
    if on_model is not None:
        return {label: target for label, target in written.items() if target != on_model.get(label)}
    rows = understood.by_label()
    return {
        label: target
        for label, target in written.items()
        if label not in rows or target != (rows[label].landmark if rows[label].used else "")
    }


def _figures(understood: Understanding, kept: dict[str, str]) -> dict[str, object]:
    """In the shape of `markers --json`."""
    return {
        "family": understood.family,
        "families": dict(understood.families),
        "labels": [
            {
                "label": row.label,
                "landmark": row.landmark,
                "body": row.body,
                "confidence": round(row.confidence, 4),
                "used": row.used,
                "family": row.family,
                "why": row.why,
                "alternatives": dict(row.alternatives),
                "corrected_to": kept.get(row.label),
            }
            for row in understood.labels
        ],
    }


def _print(understood: Understanding, kept: dict[str, str]) -> None:
    used = sum(kept[row.label] != "" if row.label in kept else row.used for row in understood.labels)
    said = f", most of them {understood.family}" if understood.family else ""
    typer.echo(f"{used} of {len(understood.labels)} labels understood{said}")
    cells = [_cells(row, kept) for row in understood.labels]
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for i, head in enumerate(("label", "landmark", "body", "sure")):
        table.add_column(head, no_wrap=True, min_width=max(len(row[i]) for row in cells))
    table.add_column("because", overflow="fold")
    for row in cells:
        table.add_row(*row)
    console(WIDTH_OF_A_PIPE).print(table)


def _cells(row: UnderstoodLabel, kept: dict[str, str]) -> tuple[str, str, str, str, str]:
    if row.label in kept:
        return row.label, kept[row.label] or "left out", "", "", "the map says so"
    unknown = "computed" if row.computed else "unknown"
    landmark = str(row.landmark) if row.used else f"({row.landmark or unknown})"
    because = row.why if row.used else f"{row.why}; {remark(row)}"
    return row.label, landmark, row.body or "", f"{row.confidence:.2f}", because


def _print_landmarks() -> None:
    for landmark in atlas().values():
        typer.echo(f"{landmark.name:24s} {landmark.body:10s} {landmark.kind:8s} {landmark.says}")


SettingsSubject = Annotated[
    Path | None,
    typer.Argument(
        metavar="[SUBJECT]",
        help="Print this subject's settings, not the defaults.",
        callback=optional_subject_folder,
    ),
]


def settings(subject: SettingsSubject = None, settings: SettingsFile = None, debug: Debug = False) -> None:
    """Print the settings as TOML; copy what you change into SUBJECT/settings.toml."""
    with errors_as_lines(debug):
        typer.echo(as_toml(_chosen(subject, settings)), nl=False)


def _chosen(subject: Path | None, file: Path | None) -> Settings:
    if subject is not None:
        return settings_for(subject, file)
    return read_settings(file) if file is not None else Settings()
