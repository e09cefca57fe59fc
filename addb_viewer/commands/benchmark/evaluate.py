"""`addb-viewer benchmark evaluate`: predictors against the forces of persons they have not seen."""

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from addb_viewer.commands.benchmark.options import (
    FeaturesOption,
    FramesOption,
    Out,
    Part,
    Predictors,
    SkeletonOption,
    SplitName,
    StartFrom,
    WithoutMass,
    results_folder,
    time_history_of,
)
from addb_viewer.commands.dataset.options import Release
from addb_viewer.commands.options import Debug
from addb_viewer.jobs.errors import errors_as_lines

Outside = Annotated[
    list[Path] | None,
    typer.Option(
        "--outside",
        metavar="FILE",
        help="Answers made elsewhere, as Parquet; the file's name is the predictor's.",
        exists=True,
        dir_okay=False,
    ),
]


def evaluate(
    release: Release,
    predictor: Predictors = None,
    outside: Outside = None,
    out: Out = None,
    split: SplitName = "default",
    part: Part = "test",
    skeleton: SkeletonOption = "unfitted",
    without_mass: WithoutMass = False,
    frames: FramesOption = "scored",
    features: FeaturesOption = "plain",
    start_from: StartFrom = None,
    debug: Debug = False,
) -> None:
    """Hold predictors against the forces of persons whom they have not seen.

    Those that learn are trained first, unless `train` has done it.
    """
    if not predictor and not outside:
        raise typer.BadParameter("what is to be evaluated?", param_hint="--predictor or --outside")
    with errors_as_lines(debug):
        from addb_viewer.benchmark import evaluating, predictors  # noqa: PLC0415 (slow to load)
        from addb_viewer.benchmark.averages import average  # noqa: PLC0415
        from addb_viewer.benchmark.outside import read_outside  # noqa: PLC0415
        from addb_viewer.benchmark.release_trials import open_for_benchmark  # noqa: PLC0415
        from addb_viewer.benchmark.results import Result, write_result  # noqa: PLC0415

        source = open_for_benchmark(release, skeleton, unweighed=without_mass)
        time_history, folder = time_history_of(source, split, part, frames), results_folder(release, out)

        def told(result: Result) -> None:
            write_result(result, folder)
            force = average(result.scores, "grf")
            said = "" if force is None else f"GRF {force.mean:.3f} N/kg, persons: {force.persons}"
            typer.echo(f"{result.name}: {said}")

        learning = predictors.Learning(features, start_from)
        for name in predictor or ():
            make = partial(predictors.predictor, name, learning)
            told(evaluating.evaluate(source, make, time_history, folder / "work"))
        for file in outside or ():
            told(evaluating.evaluate_outside(source, read_outside(file), time_history))
        typer.echo(folder)
