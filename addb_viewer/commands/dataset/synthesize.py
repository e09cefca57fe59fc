"""`addb-viewer dataset synthesize`: a corpus whose truth is known."""

from collections import Counter
from pathlib import Path
from typing import Annotated

import typer

from addb_viewer.commands.options import Debug
from addb_viewer.jobs.errors import errors_as_lines

Subjects = Annotated[
    int, typer.Option("--subjects", metavar="N", help="Good subjects; traps come on top.", min=1, max=10_000)
]
CorpusOut = Annotated[
    Path, typer.Option("--out", metavar="ROOT", help="A new folder; the truth goes to ROOT.truth.")
]
Seed = Annotated[int, typer.Option("--seed", metavar="S", help="The same one gives the same files.", min=0)]
NoTraps = Annotated[bool, typer.Option("--no-traps", help="Only subjects that a release takes.")]


def synthesize(
    subjects: Subjects, out: CorpusOut, seed: Seed = 0, no_traps: NoTraps = False, debug: Debug = False
) -> None:
    """Make up a corpus of people, faults and traps, and keep the truth about it aside."""
    with errors_as_lines(debug):
        from addb_viewer.dataset.synthesis import corpus  # noqa: PLC0415 (slow to load)

        options = corpus.CorpusOptions(subjects, seed, traps=not no_traps)
        expected = corpus.synthesize(out.resolve(), options, typer.echo)
        for reason, count in sorted(Counter(row.reason for row in expected).items()):
            typer.echo(f"to be left out: {count} × {reason}")
        typer.echo(f"{out}; the truth: {corpus.truth_folder(out)}")
