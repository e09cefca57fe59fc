"""Arguments and options that several commands share."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from solver.capture.formats.b3d.places import subject_folder_of
from solver.capture.subject.measured_files import reason_to_stay
from solver.common.file_names import readable

SubjectFolder = Annotated[
    Path,
    typer.Argument(
        metavar="SUBJECT",
        help="Folder of the recordings and, if any, the model; or a .b3d file.",
        callback=subject_folder_of,
    ),
]


def optional_subject_folder(subject: Path | None) -> Path | None:
    """Likewise of an argument that may be left out."""
    return None if subject is None else subject_folder_of(subject)


def replaceable(file: Path | None) -> Path | None:
    """A file to write, unless that would replace a recording, a model, a description, a review or a fit."""
    if file is not None and file.exists() and not file.is_dir():
        is_kept = file.suffix.lower() == ".toml" or file.name == "fit.json" or not file.is_file()
        why = reason_to_stay(file) or ("it is never replaced" if is_kept else "")
        if why:
            raise typer.BadParameter(f"{file} is there and stays as it is: {why}. Name another file.")
    return file


def written(file: Path | None) -> Path | None:
    """Likewise, in a folder that is there: what is written comes after hours of work."""
    if file is not None and not file.absolute().parent.is_dir():
        raise typer.BadParameter(f"no folder {file.parent} to write into")
    return replaceable(file)


def file_to_read(flag: str, help: str, metavar: str = "FILE") -> Any:
    """An option that names a file."""
    return typer.Option(flag, metavar=metavar, help=help, dir_okay=False)


def file_to_write(flag: str, help: str, callback: Callable[[Path | None], Path | None]) -> Any:
    """Likewise, which the callback lets be written."""
    return typer.Option(flag, metavar="FILE", help=help, dir_okay=False, callback=callback)


Out = Annotated[
    Path | None,
    typer.Option("--out", metavar="DIR", help="Results folder; SUBJECT/results by default.", file_okay=False),
]
Trials = Annotated[
    list[str] | None,
    typer.Option(
        "--trial", metavar="NAME", parser=readable, help="This trial only; may be given several times."
    ),
]
SettingsFile = Annotated[
    Path | None,
    file_to_read(
        "--settings", "TOML file of settings instead of SUBJECT/settings.toml; see `addb-viewer settings`."
    ),
]
JsonFile = Annotated[Path | None, file_to_write("--json", "Write the figures to this file as JSON.", written)]
MapFile = Annotated[
    Path | None,
    file_to_read(
        "--map", "What the labels mean, instead of SUBJECT/markers.toml; see `addb-viewer markers`."
    ),
]
IgnoreReview = Annotated[
    bool,
    typer.Option("--ignore-review", help="Leave out what people flagged, here or in a review.json."),
]
WithoutExtension = Annotated[
    bool,
    typer.Option("--without-extension", help="Leave out the causes that `accept` made part of the model."),
]
Force = Annotated[
    bool, typer.Option("--force", help="Solve from the beginning even where nothing has changed.")
]
Solve = Annotated[
    bool,
    typer.Option("--solve", help="Where the kept fit is out of date, make another beside it and take that."),
]
Host = Annotated[str, typer.Option("--host", help="Address the app listens on.")]
Port = Annotated[int, typer.Option("--port", help="Port the app listens on.", min=0, max=65535)]
Debug = Annotated[bool, typer.Option("--debug", help="Print the traceback of an error.")]

DEFAULT_HOST = "127.0.0.1"  # this machine only: recordings are people's data
DEFAULT_PORT = 8080
