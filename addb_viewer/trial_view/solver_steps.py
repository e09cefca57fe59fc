"""What a solver tells while it works, kept for a recording."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from solver.common.progress import Progress, silent


@dataclass(frozen=True)
class SolverStep:
    """One report: where the solver was, and when."""

    stage: str
    fraction: float  # of the whole work, 0 to 1
    seconds: float  # since the solve began
    values: Mapping[str, float] = field(default_factory=dict)  # figures of the stage, each with its unit


class StepLog:
    """Progress that remembers every report, and passes it on."""

    def __init__(self, progress: Progress = silent) -> None:
        self._progress, self._began = progress, time.monotonic()
        self._steps: list[SolverStep] = []

    def __call__(self, stage: str, fraction: float) -> None:
        """Take a report."""
        self._steps.append(SolverStep(stage, fraction, time.monotonic() - self._began))
        self._progress(stage, fraction)

    @property
    def steps(self) -> tuple[SolverStep, ...]:
        """What was reported so far."""
        return tuple(self._steps)


def stages_of(figures: Mapping[str, Any], costs: Sequence[float] = ()) -> tuple[SolverStep, ...]:
    """What a kept fit still knows of its solve: seconds of each stage, cost of each iteration, marker errors.

    Seconds are of CPU; an iteration's time is its even share of the stage's.

    Args:
        figures: a trial's part of `fit --json`.
        costs: of the trajectory fit: where it began, and after each iteration.
    """
    steps, seconds = [], 0.0
    total = sum(figures["seconds"].values()) or 1.0
    errors = {"kinematics": figures["kinematics_only"] or figures, "dynamics": figures}
    for stage, spent in figures["seconds"].items():
        for k, cost in enumerate(costs if stage == "dynamics" else ()):
            at = seconds + spent * k / len(costs)
            said = f"dynamics, iteration {k}" if k else "dynamics, where the search begins"
            steps.append(SolverStep(said, at / total, at, {"cost": cost}))
        seconds += spent
        rms = errors.get(stage, {}).get("marker_rms_m")
        values = {} if rms is None else {"marker_rms_cm": 100 * rms}
        steps.append(SolverStep(stage, seconds / total, seconds, values))
    return tuple(steps)
