"""`addb-viewer benchmark`: forces from motion alone on a release, and how well that works."""

from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from addb_viewer.commands.dataset import Release
from addb_viewer.commands.options import Debug
from addb_viewer.jobs.command_errors import errors_as_lines
from solver.common.errors import SolverError

if TYPE_CHECKING:
    from addb_viewer.benchmark.evaluating import TimeHistory
    from addb_viewer.benchmark.release_trials import BenchmarkRelease

Predictors = Annotated[
    list[str] | None,
    typer.Option(
        "--predictor",
        metavar="NAME",
        help="By its name (docs/reference/benchmark.md), or FILE.py:CLASS; may be given several times.",
    ),
]
Out = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="RELEASE.benchmark by default.", file_okay=False)
]
SplitName = Annotated[str, typer.Option("--split", metavar="NAME", help="Which split of the release.")]
Part = Annotated[
    str, typer.Option("--part", metavar="NAME", help="Who is tested: test, dev, a fold, or every-fold.")
]
SkeletonOption = Annotated[
    Literal["unfitted", "fitted"],
    typer.Option(
        "--skeleton",
        help="unfitted: mass as entered, inertias by table; fitted: both learnt from the forces.",
    ),
]
WithoutMass = Annotated[
    bool,
    typer.Option(
        "--without-mass",
        help="Test persons too whose mass nobody entered; they show the fitted body, which knows the forces.",
    ),
]
FramesOption = Annotated[
    Literal["scored", "all"],
    typer.Option(
        "--frames", help="scored: those that count after half a second that counts; all: that count."
    ),
]
FeaturesOption = Annotated[
    Literal["plain", "wide"],
    typer.Option(
        "--features",
        help="Of mlp and groundlinknet: plain, as the paper says; wide: also velocities and the root's past.",
    ),
]
StartFrom = Annotated[
    Path | None,
    typer.Option(
        "--start-from",
        metavar="DIR",
        help="Of mlp and groundlinknet: go on from the training in these results, of other persons.",
        exists=True,
        file_okay=False,
    ),
]
EVERY_FOLD = "every-fold"


def time_history_of(
    source: "BenchmarkRelease", split: str, part: str, frames: Literal["scored", "all"] = "scored"
) -> "TimeHistory":
    """Who is tested.

    Args:
        source: the release.
        split: its name.
        part: one, or every fold.
        frames: that are scored.
    """
    from addb_viewer.benchmark.evaluating import TimeHistory  # noqa: PLC0415 (slow to load)

    names: tuple[str, ...] = (part,)
    if part == EVERY_FOLD:
        names = tuple(sorted(set(source.release.split(split).values()) - {"train", "dev"}))
    return TimeHistory(split, names, frames)


def results_folder(release: Path, out: Path | None) -> Path:
    """Where results go.

    Args:
        release: its folder.
        out: as asked for; None: beside the release.
    """
    folder = release.resolve()
    return out or folder.with_name(f"{folder.name}.benchmark")


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
        from addb_viewer.benchmark.release_trials import open_for_benchmark  # noqa: PLC0415
        from addb_viewer.benchmark.results import (  # noqa: PLC0415
            Result,
            read_outside,
            write_result,
        )

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


def sweep(
    release: Release,
    out: Out = None,
    split: SplitName = "default",
    part: Part = "test",
    skeleton: SkeletonOption = "unfitted",
    debug: Debug = False,
) -> None:
    """Draw the error of the total force against the filter's cutoff."""
    with errors_as_lines(debug):
        if find_spec("matplotlib") is None:
            raise SolverError("figures need Matplotlib; install it: pip install 'matplotlib>=3.10'")
        from addb_viewer.benchmark import sweep as sweeping  # noqa: PLC0415 (slow to load)
        from addb_viewer.benchmark.release_trials import open_for_benchmark  # noqa: PLC0415

        source = open_for_benchmark(release, skeleton)
        parts = [source.parts(split, one).test for one in time_history_of(source, split, part).parts]
        points = sweeping.sweep(source.trials(frozenset().union(*parts)))
        if not points[0].trials:
            raise SolverError(f"no frame of {part} counts for {sweeping.FEWEST_FRAMES} frames in a row")
        folder = results_folder(release, out)
        folder.mkdir(parents=True, exist_ok=True)
        sweeping.write_csv(points, folder / "sweep.csv")
        for file in (folder / "sweep.csv", *sweeping.draw(points, folder / "sweep")):
            typer.echo(file)


Folder = Annotated[
    Path, typer.Argument(metavar="DIR", help="That evaluate wrote to.", exists=True, file_okay=False)
]
FormOption = Annotated[Literal["markdown", "csv", "latex"], typer.Option("--format", help="Of the table.")]


def table(folder: Folder, form: FormOption = "markdown", debug: Debug = False) -> None:
    """Print results as a table, the paper's beside them."""
    with errors_as_lines(debug):
        from addb_viewer.benchmark.results import read_results  # noqa: PLC0415 (slow to load)
        from addb_viewer.benchmark.tables import rendered  # noqa: PLC0415

        typer.echo(rendered(read_results(folder), form), nl=False)
