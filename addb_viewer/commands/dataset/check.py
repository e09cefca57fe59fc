"""`addb-viewer dataset check`: whether a release, or a .b3d file, may go out."""

from pathlib import Path
from typing import Annotated

import typer

from addb_viewer.commands.options import Debug, JsonFile
from addb_viewer.jobs.errors import FAILED, errors_as_lines
from addb_viewer.text.amounts import counted

What = Annotated[
    Path, typer.Argument(metavar="RELEASE", help="Folder of a release, or a .b3d file.", exists=True)
]
Refit = Annotated[
    bool, typer.Option("--refit", help="Of a .b3d file: fit and diagnose it, and print stored → ours.")
]

Against = Annotated[
    Path | None,
    typer.Option(
        "--against",
        metavar="OTHER",
        help="Of a release: say as well what it has otherwise than this one.",
        exists=True,
        file_okay=False,
    ),
]


def check(
    release: What,
    refit: Refit = False,
    against: Against = None,
    json: JsonFile = None,
    debug: Debug = False,
) -> None:
    """Say what is wrong with a release: files, schema, F = ma, torques, plausibility, duplicates, splits."""
    if refit and not release.is_file():
        raise typer.BadParameter("of a .b3d file alone; a release is fitted already", param_hint="--refit")
    if against is not None and release.is_file():
        raise typer.BadParameter("of a release alone", param_hint="--against")
    with errors_as_lines(debug):
        from dataclasses import asdict  # noqa: PLC0415

        from addb_viewer.dataset.check.against import differences  # noqa: PLC0415 (slow to load)
        from addb_viewer.dataset.check.b3d_file import b3d_findings  # noqa: PLC0415 (slow to load)
        from addb_viewer.dataset.check.checking import checked  # noqa: PLC0415
        from addb_viewer.dataset.check.finding import Level  # noqa: PLC0415
        from solver.fitting.results.store import write_json  # noqa: PLC0415

        place = release.resolve()
        found = b3d_findings(place) if place.is_file() else checked(place)
        if against is not None:
            found += differences(place, against.resolve())
        for one in found:
            typer.echo(str(one))
        errors = sum(one.level is Level.ERROR for one in found)
        typer.echo(f"{counted(errors, 'error')}, {counted(len(found) - errors, 'warning')}")
        if refit:
            _refit(place)
        if json is not None:
            write_json(json, {"errors": errors, "findings": [asdict(one) for one in found]})
    if errors:
        raise typer.Exit(FAILED)


def _refit(file: Path) -> None:
    from addb_viewer.dataset.check.refit import in_words, refitted  # noqa: PLC0415 (slow to load)
    from addb_viewer.jobs.terminal_progress import terminal_progress  # noqa: PLC0415

    with terminal_progress() as progress:
        rows, causes = refitted(file, progress)
    for line in in_words(rows, causes):
        typer.echo(line)
