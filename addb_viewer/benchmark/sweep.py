"""How the error of the total force depends on the filter that the measured and the predicted one share."""

import csv
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import numpy as np
from jaxtyping import Float

from addb_viewer.benchmark.task import Example, Trials, central_differences
from solver.capture.atomic import whole_file, write_whole
from solver.common.filters import low_pass
from solver.common.true_runs import runs
from solver.skeleton.pinocchio_model import RigidBodyModel

CUTOFFS_HZ: tuple[float | None, ...] = (*(float(c) for c in range(3, 31, 3)), None)  # None: unfiltered
FEWEST_FRAMES = 12  # of a run of counting frames: as of a release's segments
ALL = "all"


@dataclass(frozen=True)
class Point:
    """The curve's value at one cutoff."""

    activity: str  # or "all"
    cutoff_Hz: float | None
    rmse: float  # over frames and axes, mean over trials [N/kg]
    trials: int
    persons: int


def sweep(trials: Trials, cutoffs: Sequence[float | None] = CUTOFFS_HZ) -> list[Point]:
    """Error of z̈ − g, by differences of the shown motion, against the measured total force over the mass.

    Both pass the same filter, on each run of counting frames by itself.

    Args:
        trials: of the tested persons.
        cutoffs: [Hz]; None: no filter.
    """
    squares: dict[tuple[str, float | None], dict[tuple[str, str], list[np.ndarray]]] = defaultdict(
        lambda: defaultdict(list)
    )
    for example in trials:
        trial = (example.person_id, example.trial_id)
        for told, measured, activity in _runs(example):
            for cutoff in cutoffs:
                off = _filtered(told, example.seen.rate, cutoff) - _filtered(
                    measured, example.seen.rate, cutoff
                )
                squares[ALL, cutoff][trial].append(off**2)
                for one in set(activity):
                    squares[str(one), cutoff][trial].append(off[activity == one] ** 2)
    activities = [ALL, *sorted({activity for activity, _ in squares} - {ALL})]
    return [
        _point(activity, cutoff, squares[activity, cutoff]) for activity in activities for cutoff in cutoffs
    ]


def _runs(
    example: Example,
) -> Iterator[tuple[Float[np.ndarray, "frames 3"], Float[np.ndarray, "frames 3"], np.ndarray]]:
    """Predicted and measured force over mass [N/kg], and the activities, of each run of counting frames."""
    seen, measured = example.seen, example.measured
    velocity, acceleration = central_differences(seen.q, seen.rate)
    com = RigidBodyModel(seen.skeleton).centre_of_mass_acceleration(seen.q, velocity, acceleration)
    told, total = com - seen.skeleton.gravity, measured.force.sum(axis=1) / measured.mass_kg
    for start, end in runs(measured.counts):
        if end - start >= FEWEST_FRAMES:
            yield told[start:end], total[start:end], measured.activity[start:end]


def _filtered(
    values: Float[np.ndarray, "frames 3"], rate: float, cutoff: float | None
) -> Float[np.ndarray, "frames 3"]:
    return values if cutoff is None else low_pass(values, rate, cutoff)


def _point(activity: str, cutoff: float | None, squares: dict[tuple[str, str], list[np.ndarray]]) -> Point:
    errors = [float(np.sqrt(np.concatenate(pieces).mean())) for pieces in squares.values()]
    return Point(
        activity, cutoff, float(np.mean(errors)), len(errors), len({person for person, _ in squares})
    )


def write_csv(points: Sequence[Point], path: Path) -> None:
    """A line a cutoff and activity; the unfiltered one has no cutoff.

    Args:
        points: of the curves.
        path: of the file.
    """
    text = StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(["activity", "cutoff_Hz", "rmse_N_per_kg", "trials", "persons"])
    for point in points:
        rows.writerow(
            [point.activity, point.cutoff_Hz or "", f"{point.rmse:.6f}", point.trials, point.persons]
        )
    write_whole(path, text.getvalue())


def draw(points: Sequence[Point], stem: Path) -> list[Path]:
    """Error against cutoff, overall and by activity, as SVG and PNG.

    Args:
        points: of the curves.
        stem: of the files, without an ending.

    Returns:
        The files.
    """
    from matplotlib.figure import Figure  # noqa: PLC0415 (slow to load)

    figure = Figure(figsize=(10, 4), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    for activity in dict.fromkeys(point.activity for point in points):
        own = [point for point in points if point.activity == activity]
        known = [point for point in own if point.cutoff_Hz is not None]
        axes = left if activity == ALL else right
        label = f"{activity} (trials: {own[0].trials}, persons: {own[0].persons})"
        (line,) = axes.plot([p.cutoff_Hz for p in known], [p.rmse for p in known], marker="o", label=label)
        for point in own:
            if point.cutoff_Hz is None:
                axes.axhline(point.rmse, color=line.get_color(), linestyle=":", linewidth=1)
    for axes, title in ((left, "All activities"), (right, "By activity")):
        axes.set(title=title, xlabel="cutoff [Hz]", ylim=(0, None))
        if axes.lines:
            axes.legend(fontsize="small")
    left.set_ylabel("RMSE of the total force [N/kg]\ndotted: unfiltered")
    files = [stem.with_suffix(end) for end in (".svg", ".png")]
    for file in files:
        with whole_file(file) as draft:
            kind, dated = file.suffix[1:], {"Date": None} if file.suffix == ".svg" else None
            figure.savefig(draft, format=kind, metadata=dated, dpi=120)
    return files
