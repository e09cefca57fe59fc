"""What is said of a folder's files that are not used: one line, or all of them with reasons."""

from collections.abc import Sequence

import typer

from solver.capture.capture import UnusedFile

NAMED = 3  # in one line


def print_unused(files: Sequence[UnusedFile], *, whole: bool) -> None:
    """Say which files of a subject's folder are not used, the most harmful first.

    Args:
        files: as `open_subject` found them.
        whole: each with its reason.
    """
    if not files:
        return
    count = f"{len(files)} file{'s' * (len(files) > 1)} of the folder not used"
    if whole:
        typer.echo(f"{count}:")
        for file in files:
            typer.echo(f"  {file.file}: {file.reason}")
        return
    more = ", …" if len(files) > NAMED else ""
    typer.echo(f"{count}: {', '.join(file.file for file in files[:NAMED])}{more}; --notes says why")
