"""The strides of each trial and foot: spatio-temporal figures of a walk or run."""

from collections.abc import Callable, Sequence
from statistics import mean, stdev

from addb_viewer.report.markup import Safe, element, joined, table
from annotations.foot_names import foot_words
from solver.export.gait_tables import gaits_of
from solver.fit import Fit
from solver.gait.cycles import Cycle

HEAD = ("Trial", "Foot", "Strides", "Cadence", "Speed", "Stride", "Step length", "Step width", "Stance")
FINE = (
    "A stride is from one contact of a foot to the next of the same foot; mean ± standard deviation. "
    "Contact and foot-off: the foot's vertical force crosses 20 N; where no plate measures the whole stance, "
    "they are found from how fast the sole moves over the ground. Step length and width: from the other heel "
    "at its last contact to this heel at the end of the stride, along and across the stride. Stance: from "
    "contact to foot-off, in percent of the stride time. On a treadmill the belt's travel is included. "
    "Definitions: Perry & Burnfield 2010."
)


def strides_part(fit: Fit) -> Safe | None:
    """A row for each trial and foot; None where nobody takes a whole stride.

    Args:
        fit: of the subject.
    """
    rows = []
    for name, gait in gaits_of(fit).items():
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
