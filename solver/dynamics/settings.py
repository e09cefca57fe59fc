"""Settings of inverse dynamics, each with its reason."""

from dataclasses import dataclass

from solver.common.settings_field import setting


@dataclass(frozen=True)
class DynamicsSettings:
    """Which frames the figures leave out, and how forces are predicted that nobody measured."""

    end_frames: int = setting(
        10,
        unit="frames",
        least=0.0,
        why="left out of the figures at each end of a trial: spline and filter know no motion beyond it, "
        "and accelerations there are off by 15 to 400 N",
    )
    unmeasured_cutoff_Hz: float = setting(
        5.0,
        unit="Hz",
        why="of motion and forces of a trial on which no force counts. 5 to 7 Hz do equally well in walks; "
        "a run errs by 1.3 N/kg with 5 and 1.8 with 6, drop jumps by a tenth less with 6 "
        "(benchmarks/NO_PLATES.md)",
    )
