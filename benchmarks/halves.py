"""`python -m benchmarks.halves --out FILE`: weights chosen on one half of the people and judged on the other.

Then the other way round. What foretells missing forces has two weights that withheld forces could have
chosen: the sister fit's smoothness and its residual. Each is tried at half and twice its size; figures are
RMS over six layouts of withheld blocks. FILE keeps them, so that a run goes on where it was stopped.
"""

import argparse
import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.recordings import data_folder
from solver.capture.atomic import write_whole
from solver.capture.subject import open_subject
from solver.dynamics.heldout import WithheldBlocks
from solver.dynamics.withheld_figures import against_markers
from solver.dynamics.withheld_layouts import BLOCKS, LAYOUTS
from solver.pipeline import solve
from solver.progress import silent
from solver.settings import Settings
from solver.withheld_stage import judged_layout

PEOPLE = (
    "walk_gait2354_subject01",
    "opencap_subject6",
    "walk_rajagopal2015",
    "overground_falisse_AdDB",
    "run_treadmill_hamner2013_subject04",
    "walk_treadmill_stepwidth",
    "opencap_reviewed",
)  # every second one makes a half
FACTORS = {"as set": (1.0, 1.0), "half as smooth": (0.5, 1.0), "twice as smooth": (2.0, 1.0)} | {
    "half the residual": (1.0, 0.5),
    "twice the residual": (1.0, 2.0),
}


def main() -> None:
    """Work out what is missing, print tables."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.halves", description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    out = parser.parse_args().out
    found = json.loads(out.read_text()) if out.exists() else {}
    for person in PEOPLE:
        for name, factors in FACTORS.items():
            if f"{person}: {name}" not in found:
                found[f"{person}: {name}"] = missed(person, *factors)
                write_whole(out, json.dumps(found, indent=1) + "\n")
                print(f"{person}: {name}: {found[f'{person}: {name}']}", flush=True)
    print(table(found))


def missed(person: str, smoothness: float, residual: float) -> list[list[float]]:
    """By trial: force [N] and moment [N·m], of the fit and of the markers at their best."""
    foretelling = Settings().foretelling
    settings = replace(
        Settings(),
        foretelling=replace(
            foretelling,
            smoothness=smoothness * foretelling.smoothness,
            residual_force_std_N=residual * foretelling.residual_force_std_N,
            residual_moment_std_Nm=residual * foretelling.residual_moment_std_Nm,
        ),
    )
    fit = solve(open_subject(data_folder() / person), settings)
    blocks: dict[str, list[WithheldBlocks]] = {}
    for layout in (layout for layout in LAYOUTS if layout[0] == BLOCKS):
        for trial, own in judged_layout(fit, layout, settings, silent).trials.items():
            blocks.setdefault(trial, []).append(own)
    figures = [against_markers(own) for own in blocks.values()]
    return [[force.fit, moment.fit, force.markers, moment.markers] for force, moment in figures]


def table(found: dict[str, list[list[float]]]) -> str:
    """Of both halves, what they would choose, and what that is worth on the other."""
    halves = PEOPLE[::2], PEOPLE[1::2]
    lines = ["| weights | first half | second half |", "|---|---:|---:|"]
    scores = {name: [_score(found, half, name) for half in halves] for name in FACTORS}
    for name, (first, second) in scores.items():
        lines.append(f"| {name} | {first:.3f} | {second:.3f} |")
    for chooser, judge in ((0, 1), (1, 0)):
        best = min(scores, key=lambda name: scores[name][chooser])
        own, as_set = scores[best][judge], scores["as set"][judge]
        lines.append(
            f"\nThe {('first', 'second')[chooser]} half chooses: {best}. On the other half that misses "
            f"{own:.3f} of what markers at their best miss; the weights as set miss {as_set:.3f}."
        )
    return "\n".join(lines)


def _score(found: dict[str, list[list[float]]], half: tuple[str, ...], name: str) -> float:
    """Geometric mean over trials, force and moment, of fit / markers; every person counts alike."""
    by_person = []
    for person in half:
        figures = np.array(found[f"{person}: {name}"])
        if len(figures):
            by_person.append(np.log(figures[:, :2] / figures[:, 2:]).mean())
    return float(np.exp(np.mean(by_person)))


if __name__ == "__main__":
    main()
