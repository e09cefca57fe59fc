"""`addb-viewer dataset split`: who is for training, development and test."""

from pathlib import Path
from typing import Annotated

import typer

from addb_viewer.commands.dataset.options import Release
from addb_viewer.commands.options import Debug
from addb_viewer.jobs.errors import errors_as_lines
from addb_viewer.text.amounts import counted

Name = Annotated[str, typer.Option("--name", metavar="NAME", help="Of the split: splits/NAME.parquet.")]
Seed = Annotated[int, typer.Option("--seed", metavar="N", help="Of the order among alike persons.")]
Previous = Annotated[
    Path | None,
    typer.Option(
        "--previous", metavar="FILE", help="An earlier split; everybody in it keeps theirs.", dir_okay=False
    ),
]
Folds = Annotated[
    int | None, typer.Option("--kfold", metavar="K", help="K folds of persons instead of 90:5:5.", min=2)
]
OneOut = Annotated[
    bool, typer.Option("--leave-one-person-out", help="A fold for every person instead of 90:5:5.")
]
HeldOut = Annotated[
    list[str] | None,
    typer.Option(
        "--hold-out-source",
        metavar="SOURCE",
        help="All of this source for test, the others for train and dev; may be given several times.",
    ),
]


def split(
    release: Release,
    name: Name = "default",
    seed: Seed = 0,
    previous: Previous = None,
    kfold: Folds = None,
    leave_one_person_out: OneOut = False,
    hold_out_source: HeldOut = None,
    debug: Debug = False,
) -> None:
    """Say which persons of a release are for training, development and test."""
    ways = {
        "--kfold": kfold is not None,
        "--leave-one-person-out": leave_one_person_out,
        "--hold-out-source": bool(hold_out_source),
    }
    asked = [option for option, wanted in ways.items() if wanted]
    if len(asked) > 1:
        raise typer.BadParameter(f"{asked[0]} and {asked[1]} are two kinds of split; give one")
    if Path(name).name != name or name.startswith("."):
        raise typer.BadParameter("a name without folders, please", param_hint="--name")
    with errors_as_lines(debug):
        from addb_viewer.dataset import split_files, splits  # noqa: PLC0415 (slow to load)

        persons = split_files.persons_in(release)
        kept = split_files.read_split(previous) if previous else None
        if kfold is not None:
            made, kind = splits.k_fold(persons, kfold, seed, kept), f"{kfold} folds"
        elif leave_one_person_out:
            made, kind = splits.leave_one_person_out(persons), "leave one person out"
        elif hold_out_source:
            made, kind = splits.hold_out(persons, hold_out_source, seed, kept), "sources held out"
        else:
            made, kind = splits.by_shares(persons, seed, previous=kept), "90:5:5"
        options = {"kind": kind, "seed": seed, "held_out": hold_out_source or [], "previous": bool(previous)}
        path = split_files.write_split(release, name, made, persons, options)
        for split_name, count in splits.counts_of(persons, made)["all"].get("all", {}).items():
            typer.echo(f"{split_name}: {counted(count, 'person')}")
        if kind == "90:5:5" and splits.TEST not in made.values():
            typer.echo(
                f"note: nobody is in test: {counted(len(persons), 'person')} are too few for 90:5:5. "
                "--leave-one-person-out tests each of them once"
            )
        typer.echo(path)
