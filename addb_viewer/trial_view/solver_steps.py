"""What a kept fit still knows of its solve, step by step."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from solver.fitting.fit_summary import TrialFigures


@dataclass(frozen=True)
class SolverStep:
    """Where the solver was, and when."""

    stage: str
    fraction: float  # of the whole work, 0 to 1
    seconds: float  # since the solve began
    values: Mapping[str, float] = field(default_factory=dict)  # figures of the stage, each with its unit


def stages_of(figures: TrialFigures, costs: Sequence[float] = ()) -> tuple[SolverStep, ...]:
    """What a kept fit still knows of its solve: seconds of each stage, cost of each iteration, marker errors.

    Seconds are of CPU; an iteration's time is its even share of the stage's.

    Args:
        figures: of the trial.
        costs: of the trajectory fit: where it began, and after each iteration.
    """
    steps, seconds = [], 0.0
    known = {stage: spent or 0.0 for stage, spent in figures.seconds.items()}
    total = sum(known.values()) or 1.0
    errors = {"kinematics": figures.kinematics_only or figures, "dynamics": figures}
    for stage, spent in known.items():
        for k, cost in enumerate(costs if stage == "dynamics" else ()):
            at = seconds + spent * k / len(costs)
            said = f"dynamics, iteration {k}" if k else "dynamics, where the search begins"
            steps.append(SolverStep(said, at / total, at, {"cost": cost}))
        seconds += spent
        rms = errors[stage].marker_rms_m if stage in errors else None
        values = {} if rms is None else {"marker_rms_cm": 100 * rms}
        steps.append(SolverStep(stage, seconds / total, seconds, values))
    return tuple(steps)
