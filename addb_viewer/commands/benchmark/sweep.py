"""`addb-viewer benchmark sweep`: error against the filter's cutoff."""

from importlib.util import find_spec

import typer

from addb_viewer.commands.benchmark.options import (
    Out,
    Part,
    SkeletonOption,
    SplitName,
    results_folder,
    time_history_of,
)
from addb_viewer.commands.dataset.options import Release
from addb_viewer.commands.options import Debug
from addb_viewer.jobs.errors import errors_as_lines
from solver.common.errors import SolverError


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
