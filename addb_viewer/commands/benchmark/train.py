"""`addb-viewer benchmark train`: predictors learn from the training persons."""

from functools import partial

import typer

from addb_viewer.commands.benchmark.options import (
    FeaturesOption,
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


def train(
    release: Release,
    predictor: Predictors = None,
    out: Out = None,
    split: SplitName = "default",
    part: Part = "test",
    skeleton: SkeletonOption = "unfitted",
    without_mass: WithoutMass = False,
    features: FeaturesOption = "plain",
    start_from: StartFrom = None,
    debug: Debug = False,
) -> None:
    """Let predictors learn from a release's training persons.

    A training that was stopped goes on where it was. No file of a person who is tested is opened.
    """
    if not predictor:
        raise typer.BadParameter("which one is to learn?", param_hint="--predictor")
    with errors_as_lines(debug):
        from addb_viewer.benchmark import evaluating, predictors, release_trials  # noqa: PLC0415 (slow)

        source = release_trials.open_for_benchmark(release, skeleton, unweighed=without_mass)
        time_history, work = time_history_of(source, split, part), results_folder(release, out) / "work"
        learning = predictors.Learning(features, start_from)
        for name in predictor:
            make = partial(predictors.predictor, name, learning)
            typer.echo(evaluating.train(source, make, time_history, work))
