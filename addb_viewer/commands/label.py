"""`addb-viewer label`: take in a CSV table of labels."""

from pathlib import Path
from typing import Annotated

import typer

from addb_viewer.commands.options import Debug, SubjectFolder
from addb_viewer.commands.reviewing import Author, author_named, tell_unreadable
from addb_viewer.jobs.errors import errors_as_lines
from addb_viewer.jobs.review_store import open_log, take_in
from addb_viewer.jobs.reviewing import capture_of, subject_in, trial_of
from annotations.errors import ReviewError
from annotations.ranges_csv import tables_from_csv

Table = Annotated[
    Path, typer.Argument(metavar="FILE", help="CSV table, as `flags --csv` writes it.", dir_okay=False)
]


def label(subject: SubjectFolder, file: Table, author: Author = None, debug: Debug = False) -> None:
    """Take in a table of labels; they count wherever nobody has decided here."""
    with errors_as_lines(debug):
        opened, name = subject_in(subject), author_named(author)
        captures = {trial.name: capture_of(opened, trial) for trial in opened.trials}
        frames = {trial: capture.markers.frames for trial, capture in captures.items()}
        tables, ignored = tables_from_csv(_text(file), file.name, name, frames, opened.foot_bodies)
        with open_log(subject) as log:
            for trial, table in tables.items():
                number = take_in(log, trial_of(opened, trial), captures[trial], table)
                labels = len(table.ranges) + len(table.activities)
                status = f", {table.status}" if table.status else ""
                typer.echo(f"{trial}: {labels} ranges imported{status} (edit {number})")
            tell_unreadable(log)
        if ignored:
            typer.echo(f"note: not imported: the columns {', '.join(ignored)}")


def _text(file: Path) -> str:
    """The text of a table; a spreadsheet's byte-order mark is no part of it."""
    try:
        return file.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise ReviewError(f"{file}: is not UTF-8 text; save it as CSV UTF-8") from error
