"""`addb-viewer dataset show`: what a release holds, and where a trial's numbers come from."""

from typing import Annotated

import typer

from addb_viewer.commands.dataset.options import Release
from addb_viewer.commands.options import Debug
from addb_viewer.jobs.errors import errors_as_lines

Trial = Annotated[
    str | None, typer.Argument(metavar="[TRIAL]", help="A trial's id, or the end of it if only one ends so.")
]


def show(release: Release, trial: Trial = None, debug: Debug = False) -> None:
    """Say what a release holds; or of a trial where its numbers come from."""
    with errors_as_lines(debug):
        from addb_viewer.dataset import open as open_release  # noqa: PLC0415 (loads PyArrow)
        from addb_viewer.dataset.showing import overview, trial_in_words  # noqa: PLC0415 (likewise)

        opened = open_release(release)
        for line in overview(opened) if trial is None else trial_in_words(opened, trial):
            typer.echo(line)
