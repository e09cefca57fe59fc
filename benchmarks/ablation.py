"""Figures of `addb-viewer ablation --json` as Markdown; makes the long synthetic walk when asked to.

python -m benchmarks.ablation --long-walk FOLDER [SECONDS]
python -m benchmarks.ablation FIGURES.json ...
"""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.long_walk import write_long_walk

SEED = 1
HEADER = "| hidden | arm | seen N | seen N·m | markers cm | hidden N | hidden N·m | knee N·m |"
FIGURES = (
    ("residual_N", 1, ".1f"),
    ("residual_Nm", 1, ".1f"),
    ("marker_rms_m", 100, ".2f"),
    ("hidden_N", 1, ".0f"),
    ("hidden_Nm", 1, ".0f"),
    ("knee_Nm", 1, ".1f"),
)


def table(figures: dict[str, Any]) -> str:
    """A line per condition and arm: mean ± standard deviation."""
    lines = [HEADER, "|---|---|" + "---:|" * len(FIGURES)]
    for condition in figures["conditions"]:
        for arm, found in condition["arms"].items():
            cells = [_cell(found[name], factor, form) for name, factor, form in FIGURES]
            lines.append(
                f"| {condition['name']} ({condition['repetitions']}) | {arm} | {' | '.join(cells)} |"
            )
    return "\n".join(lines)


def settled(figures: dict[str, Any]) -> str:
    """How many runs had an arm that did not settle."""
    runs = [run for condition in figures["conditions"] for run in condition["runs"]]
    unsettled = sum(bool(run["notes"]) for run in runs)
    return f"{unsettled} of {len(runs)} runs have an arm whose fit did not settle."


def _cell(statistics: dict[str, float | None], factor: float, form: str) -> str:
    mean, std = statistics["mean"], statistics["std"]
    if mean is None:
        return "–"
    return format(factor * mean, form) + ("" if std is None else f" ± {factor * std:{form}}")


def main(arguments: list[str]) -> None:
    if arguments[0] == "--long-walk":
        duration = float(arguments[2]) if len(arguments) > 2 else 50.0
        write_long_walk(Path(arguments[1]), duration, np.random.default_rng(SEED))
        return
    for name in arguments:
        figures = json.loads(Path(name).read_text(encoding="utf-8"))
        print(f"### {figures['trial']}, {len(figures['right_steps'])} right steps\n")
        print(f"{table(figures)}\n\n{settled(figures)}\n")


if __name__ == "__main__":
    main(sys.argv[1:])
