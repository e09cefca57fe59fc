"""`addb-viewer benchmark table`: results as Markdown, CSV or LaTeX."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from addb_viewer.commands.options import Debug
from addb_viewer.jobs.errors import errors_as_lines

Folder = Annotated[
    Path, typer.Argument(metavar="DIR", help="That evaluate wrote to.", exists=True, file_okay=False)
]
FormOption = Annotated[Literal["markdown", "csv", "latex"], typer.Option("--format", help="Of the table.")]


def table(folder: Folder, form: FormOption = "markdown", debug: Debug = False) -> None:
    """Print results as a table, the paper's beside them."""
    with errors_as_lines(debug):
        from addb_viewer.benchmark.results import read_results  # noqa: PLC0415 (slow to load)
        from addb_viewer.benchmark.tables import rendered  # noqa: PLC0415

        typer.echo(rendered(read_results(folder), form), nl=False)
