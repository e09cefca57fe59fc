"""`addb-viewer dataset check`: whether a release may go out."""

import typer

from addb_viewer.commands.dataset.options import Release
from addb_viewer.commands.errors import FAILED, errors_as_lines
from addb_viewer.commands.options import Debug, JsonFile


def check(release: Release, json: JsonFile = None, debug: Debug = False) -> None:
    """Say what is wrong with a release: files, schema, F = ma, torques, plausibility, duplicates, splits."""
    with errors_as_lines(debug):
        from dataclasses import asdict  # noqa: PLC0415

        from addb_viewer.dataset.check.checking import checked  # noqa: PLC0415 (slow to load)
        from addb_viewer.dataset.check.finding import Level  # noqa: PLC0415
        from solver.results.store import write_json  # noqa: PLC0415

        found = checked(release.resolve())
        for one in found:
            typer.echo(str(one))
        errors = sum(one.level is Level.ERROR for one in found)
        typer.echo(f"{errors} errors, {len(found) - errors} warnings")
        if json is not None:
            write_json(json, {"errors": errors, "findings": [asdict(one) for one in found]})
    if errors:
        raise typer.Exit(FAILED)
