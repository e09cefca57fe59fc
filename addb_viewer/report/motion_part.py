"""What the motion shows: figures of a walk or run, and what the fit to forces changed in it."""

from collections.abc import Callable, Mapping, Sequence
from statistics import mean, stdev

from addb_viewer.report.markup import Safe, element, joined, table
from addb_viewer.text.change_words import (
    READING,
    ChangeRow,
    bands_in_words,
    change_rows,
    change_sentence,
    limit_in_words,
)
from annotations.foot_names import foot_words
from solver.fitting.fit_summary import ChangeFigures, TrialFigures
from solver.gait.cycles import Cycle
from solver.gait.trial_gait import Gait

HEAD = ("Trial", "Foot", "Strides", "Cadence", "Speed", "Stride", "Step length", "Step width", "Stance")
FINE = (
    "A stride is from one contact of a foot to the next of the same foot; mean ± standard deviation. "
    "Contact and foot-off: the foot's vertical force crosses 20 N; where no plate measures the whole stance, "
    "they are found from how fast the sole moves over the ground. Step length and width: from the other heel "
    "at its last contact to this heel at the end of the stride, along and across the stride. Stance: from "
    "contact to foot-off, in percent of the stride time. On a treadmill the belt's travel is included. "
    "Definitions: Perry & Burnfield 2010."
)


def strides_part(gaits: Mapping[str, Gait]) -> Safe | None:
    """A row for each trial and foot; None where nobody takes a whole stride.

    Args:
        gaits: by trial.
    """
    rows = []
    for name, gait in gaits.items():
        for foot, body in enumerate(gait.feet):
            own = [cycle for cycle in gait.cycles if cycle.foot == foot]
            if own:
                rows.append([name, foot_words(body), str(len(own)), *_figures(own)])
    if not rows:
        return None
    return joined((element("h3", "Strides"), table(HEAD, rows), element("p", FINE, class_="fine")))


def _figures(cycles: Sequence[Cycle]) -> list[str]:
    return [
        _spread(cycles, lambda cycle: cycle.cadence_per_min, "steps/min", 0),
        _spread(cycles, lambda cycle: cycle.speed_m_s, "m/s", 2),
        _spread(cycles, lambda cycle: cycle.stride_length_m, "m", 2),
        _spread(cycles, lambda cycle: cycle.step_length_m, "m", 2),
        _spread(cycles, lambda cycle: cycle.step_width_m, "m", 2),
        _spread(
            cycles, lambda cycle: None if cycle.stance_share is None else 100 * cycle.stance_share, "%", 0
        ),
    ]


def _spread(cycles: Sequence[Cycle], figure: Callable[[Cycle], float | None], unit: str, digits: int) -> str:
    known = [value for value in map(figure, cycles) if value is not None]
    if not known:
        return ""
    spread = f" ± {stdev(known):.{digits}f}" if len(known) > 1 else ""
    return f"{mean(known):.{digits}f}{spread} {unit}"


def changed_part(trials: Sequence[TrialFigures]) -> Safe:
    """A sentence a trial, and its table one click away; empty where no trial was fitted to forces.

    Args:
        trials: in the shape of `fit --json`.
    """
    pieces = []
    for figures in trials:
        change = figures.change
        if change is None or not change_sentence(change):
            continue
        name = f"{figures.name}: " if len(trials) > 1 else ""
        pieces.append(element("p", f"{name}{change_sentence(change)}."))
        told = (
            "Root mean squares; the constant part and the bands add up as squares. Small: gain and phase "
            "against the markers' motion, where that has 0.2° or 1 mm there; a positive phase is early. "
            f"Range and peak speed of the fit; in brackets against {limit_in_words(change)}: more than that "
            "is faster movement that the fit keeps. Both leave out 0.1 s at the ends."
        )
        pieces.append(
            element(
                "details",
                element("summary", "By coordinate and frequency"),
                element("p", told, class_="fine"),
                _table(change),
            )
        )
    if not pieces:
        return Safe("")
    heading = element("h3", "What the fit to forces changed in the motion")
    return joined((heading, element("p", READING), *pieces))


def _table(change: ChangeFigures) -> Safe:
    head = ("Coordinate", "RMS", "constant", *bands_in_words(change), "Range", "Peak speed")
    return table(head, [_cells(row) for row in change_rows(change)], "changed")


def _cells(row: ChangeRow) -> list[str]:
    bands = [
        joined((rms, element("small", gain))) if gain else rms
        for rms, gain in zip(row.bands, row.gains, strict=True)
    ]
    return [row.coordinate, row.rms, row.offset, *bands, row.range, row.peak_speed]
