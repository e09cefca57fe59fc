"""What a kept fit still knows of its solve, step by step."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class SolverStep:
    """Where the solver was, and when."""

    stage: str
    fraction: float  # of the whole work, 0 to 1
    seconds: float  # since the solve began
    values: Mapping[str, float] = field(default_factory=dict)  # figures of the stage, each with its unit


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
