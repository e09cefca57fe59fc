"""Options that the commands of the benchmark share."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

if TYPE_CHECKING:
    from addb_viewer.benchmark.evaluating import TimeHistory
    from addb_viewer.benchmark.release_trials import BenchmarkRelease

Predictors = Annotated[
    list[str] | None,
    typer.Option(
        "--predictor",
        metavar="NAME",
        help="By its name (docs/benchmark.md), or FILE.py:CLASS; may be given several times.",
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
