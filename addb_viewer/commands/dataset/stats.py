"""`addb-viewer dataset stats`: the dataset paper's tables and figures of a release."""

from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Literal

import typer

from addb_viewer.commands.dataset.options import Release
from addb_viewer.commands.options import Debug
from addb_viewer.jobs.errors import errors_as_lines
from addb_viewer.text.amounts import counted, lasting
from solver.common.errors import SolverError

StatsOut = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="RELEASE.stats by default.", file_okay=False)
]
FramesOption = Annotated[
    Literal["paper", "reviewed", "all"] | None,
    typer.Option(
        "--frames",
        help="paper: reviewed, and detection finds no fault either. Without a word: paper; all where a "
        "release has no such frame.",
    ),
]


def stats(release: Release, out: StatsOut = None, frames: FramesOption = None, debug: Debug = False) -> None:
    """Write the dataset paper's tables and figures of a release, and a page that holds them all."""
    with errors_as_lines(debug):
        if find_spec("matplotlib") is None:
            raise SolverError("figures need Matplotlib; install it: pip install 'matplotlib>=3.10'")
        from addb_viewer.dataset.stats.gathering import Frames  # noqa: PLC0415 (slow to load)
        from addb_viewer.dataset.stats.writing import write_stats  # noqa: PLC0415

        folder = release.resolve()
        place = out or folder.with_name(f"{folder.name}.stats")
        found, path = write_stats(folder, place, frames and Frames(frames))
        total = found.tables["sources"][-1]
        hours = f"{lasting(total['total_hours'])}, {lasting(total['grf_hours'])} in the figures"
        typer.echo(f"{counted(total['subjects'], 'person')}, {hours}")
        if not total["grf_hours"]:
            typer.echo(
                f"note: no frame is such (--frames {found.frames}): figures are empty; try --frames all"
            )
        elif frames is None and found.frames is Frames.ALL:
            typer.echo("note: no frame is reviewed and without a fault: figures are about all that count")
        typer.echo(path)
