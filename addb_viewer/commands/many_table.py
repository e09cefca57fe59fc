"""What became of many subjects: a line each, a table, CSV."""

import csv
import io
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from solver.capture.atomic import write_whole

_WIDTH_OF_A_PIPE = 120  # [characters] where no terminal says how wide it is


class Status(StrEnum):
    """How a subject ended."""

    DONE = "done"
    KEPT = "kept"  # nothing had changed since the last time
    FAILED = "failed"


@dataclass(frozen=True)
class Outcome:
    """One subject."""

    subject: str  # its folder below the root
    status: Status
    seconds: float  # [s] on the clock
    reason: str  # of a failure; else what the command warned of
    row: Mapping[str, str | float | None]  # figures in short, by name with unit
    figures: Mapping[str, Any]  # of the command's own JSON
    warnings: tuple[str, ...] = ()  # lines of the command's own summary, from the exclamation mark on

    def as_json(self) -> dict[str, Any]:
        """Plain values."""
        return {
            "subject": self.subject,
            "status": self.status.value,
            "seconds": round(self.seconds, 1),
            "reason": self.reason,
            "summary": dict(self.row),
            "figures": dict(self.figures),
        }


def line_of(outcome: Outcome) -> str:
    """One line: the subject, how it ended, its figures."""
    figures = ", ".join(f"{name} {_shown(value)}" for name, value in outcome.row.items() if value is not None)
    said = (
        outcome.reason
        if outcome.status is Status.FAILED
        else "; ".join(filter(None, [figures, outcome.reason]))
    )
    return f"{outcome.subject}: {outcome.status} ({outcome.seconds:.0f} s){': ' * bool(said)}{said}"


def print_table(outcomes: Sequence[Outcome]) -> None:
    """All subjects with their figures on stdout."""
    console = Console(highlight=False, width=None if sys.stdout.isatty() else _WIDTH_OF_A_PIPE)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("subject", overflow="fold", min_width=8)
    table.add_column("", no_wrap=True)
    heads = _heads(outcomes)
    for head in heads:
        table.add_column(Text(head), justify="right", overflow="fold")
    for outcome in outcomes:
        style = "red" if outcome.status is Status.FAILED else ""
        cells = [Text(_shown(outcome.row.get(head))) for head in heads]
        table.add_row(Text(outcome.subject), Text(outcome.status, style=style), *cells)
    console.print(table)


def write_csv(file: Path, outcomes: Sequence[Outcome]) -> None:
    """The table, with the reasons of failures."""
    heads = _heads(outcomes)
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(["subject", "status", "seconds", *heads, "reason"])
    for outcome in outcomes:
        values = ["" if outcome.row.get(head) is None else outcome.row[head] for head in heads]
        rows.writerow([outcome.subject, outcome.status, f"{outcome.seconds:.1f}", *values, outcome.reason])
    write_whole(file, text.getvalue())


def _heads(outcomes: Sequence[Outcome]) -> list[str]:
    return list(dict.fromkeys(head for outcome in outcomes for head in outcome.row))


def _shown(value: str | float | None) -> str:
    if value is None:
        return "–"
    return f"{value:.3g}" if isinstance(value, float) else str(value)
