"""The ablation's figures as a table and as JSON: mean ± standard deviation over the choices of steps."""

import math
import sys
from dataclasses import asdict, dataclass

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from solver.common.runs import runs
from solver.dynamics.cross_validation.ablation import ArmFigures, Repetition

_WIDTH_OF_A_PIPE = 120  # [characters] where no terminal says how wide it is
_COLUMNS = {  # figure: head, factor to the head's unit, format
    "residual_N": ("seen frames\nforce N", 1, ".1f"),
    "residual_Nm": ("\nmoment N·m", 1, ".1f"),
    "marker_rms_m": ("all frames\nmarker cm", 100, ".2f"),
    "hidden_N": ("hidden frames\nforce N", 1, ".0f"),
    "hidden_Nm": ("\nmoment N·m", 1, ".0f"),
    "knee_Nm": ("all frames\nknee N·m", 1, ".1f"),
}
_LEGEND = (
    "RMS. seen: frames whose forces the oracle and ours both see. hidden: what the motion demands less the "
    "hidden measurement. knee: right knee's torque less the oracle's. ±: standard deviation over the choices."
)


@dataclass(frozen=True)
class Condition:
    """How steps were chosen, and what came of each choice."""

    name: str
    repetitions: tuple[Repetition, ...]

    def values(self, arm: str, figure: str) -> list[float]:
        """One figure of an arm, by repetition; without those that have no frame to judge."""
        found = [getattr(r.figures[arm], figure) for r in self.repetitions]
        return [value for value in found if math.isfinite(value)]


def print_conditions(trial: str, steps: int, conditions: list[Condition]) -> None:
    """Print a table per condition."""
    console = Console(highlight=False, width=None if sys.stdout.isatty() else _WIDTH_OF_A_PIPE)
    console.print(Text(f"{trial}: {steps} right steps"))
    for condition in conditions:
        console.print(_table(condition))
    console.print(_LEGEND, style="dim")
    for note in dict.fromkeys(n for c in conditions for r in c.repetitions for n in r.notes):
        console.print(Text(f"note: {note}"), soft_wrap=True)


def as_json(conditions: list[Condition]) -> dict[str, object]:
    """Means, standard deviations (null for a single one) and single figures, SI units."""
    return {
        "conditions": [
            {
                "name": condition.name,
                "repetitions": len(condition.repetitions),
                "arms": {
                    arm: {figure: _statistics(condition.values(arm, figure)) for figure in asdict(figures)}
                    for arm, figures in condition.repetitions[0].figures.items()
                },
                "runs": [_run_as_json(repetition) for repetition in condition.repetitions],
            }
            for condition in conditions
        ]
    }


def _run_as_json(repetition: Repetition) -> dict[str, object]:
    """Hidden ranges, figures by arm (null where there is no frame to judge), notes."""
    return {
        "hidden": [list(run) for run in runs(repetition.hidden)],
        "arms": {arm: _numbers(figures) for arm, figures in repetition.figures.items()},
        "notes": list(repetition.notes),
    }


def _table(condition: Condition) -> Table:
    count = len(condition.repetitions)
    title = f"{condition.name} hidden, {count} choice{'s' if count > 1 else ''}"
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, title=title, title_justify="left")
    table.add_column("arm")
    for head, _, _ in _COLUMNS.values():
        table.add_column(head, justify="right", no_wrap=True)
    for arm in condition.repetitions[0].figures:
        table.add_row(
            arm,
            *(
                _cell(condition.values(arm, figure), factor, form)
                for figure, (_, factor, form) in _COLUMNS.items()
            ),
        )
    return table


def _cell(values: list[float], factor: float, form: str) -> str:
    statistics = _statistics(values)
    mean, std = statistics["mean"], statistics["std"]
    if mean is None:
        return "–"
    return format(factor * mean, form) + (f" ± {factor * std:{form}}" if std is not None else "")


def _statistics(values: list[float]) -> dict[str, float | None]:
    return {
        "mean": float(np.mean(values)) if values else None,
        "std": float(np.std(values, ddof=1)) if len(values) > 1 else None,
    }


def _numbers(figures: ArmFigures) -> dict[str, float | None]:
    return {name: value if math.isfinite(value) else None for name, value in asdict(figures).items()}
