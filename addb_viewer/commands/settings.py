"""`addb-viewer settings`: every setting with its unit and the reason for its value, as a TOML file."""

from pathlib import Path
from typing import Annotated

import typer

from addb_viewer.commands.options import Debug, SettingsFile, optional_subject_folder
from addb_viewer.jobs.errors import errors_as_lines
from solver.fitting.settings import Settings, as_toml, read_settings, settings_for

OptionalSubject = Annotated[
    Path | None,
    typer.Argument(
        metavar="[SUBJECT]",
        help="Print this subject's settings, not the defaults.",
        callback=optional_subject_folder,
    ),
]


def settings(subject: OptionalSubject = None, settings: SettingsFile = None, debug: Debug = False) -> None:
    """Print the settings as TOML; copy what you change into SUBJECT/settings.toml."""
    with errors_as_lines(debug):
        typer.echo(as_toml(_chosen(subject, settings)), nl=False)


def _chosen(subject: Path | None, file: Path | None) -> Settings:
    if subject is not None:
        return settings_for(subject, file)
    return read_settings(file) if file is not None else Settings()
