"""`addb-viewer convert`: one file to another, chosen by their endings."""

from pathlib import Path
from typing import Annotated

import typer

from addb_viewer.commands.options import Debug, Trials
from addb_viewer.jobs.errors import errors_as_lines

Source = Annotated[
    Path,
    typer.Argument(
        metavar="IN",
        help="A .c3d, .trc, .mot, .b3d or .parquet file, or a folder with a model and its motions.",
    ),
]
Target = Annotated[
    Path,
    typer.Argument(
        metavar="OUT",
        help="A file in .c3d, .trc, .mot, .b3d, .parquet, .glb or .xml (MuJoCo), or a folder (OpenSim).",
    ),
]
Forces = Annotated[
    Path | None,
    typer.Option(
        "--forces", metavar="FILE", help="Table of ground forces that belongs to IN.", dir_okay=False
    ),
]
Model = Annotated[
    Path | None,
    typer.Option(
        "--model",
        metavar="FILE",
        help="OpenSim model whose coordinates IN, a .mot file, holds.",
        dir_okay=False,
    ),
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace files that are there.")]


def convert(
    source: Source,
    target: Target,
    forces: Forces = None,
    model: Model = None,
    trial: Trials = None,
    overwrite: Overwrite = False,
    debug: Debug = False,
) -> None:
    """Write what a file holds in another format, without a fit; says what the other cannot hold."""
    from solver.export.conversion.convert import convert as converted  # noqa: PLC0415 (loads all formats' libraries)

    with errors_as_lines(debug):
        done = converted(source, target, forces=forces, model=model, trials=trial or (), overwrite=overwrite)
        for path in done.files:
            typer.echo(path)
        for note in done.notes:
            typer.echo(f"note: {note}")
