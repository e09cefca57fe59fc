"""Settings of inverse dynamics, each with its reason."""

from dataclasses import dataclass

from solver.settings_field import setting


@dataclass(frozen=True)
class DynamicsSettings:
    """Which frames the figures leave out."""

    end_frames: int = setting(
        10,
        unit="frames",
        least=0.0,
        why="left out of the figures at each end of a trial: spline and filter know no motion beyond it, "
        "and accelerations there are off by 15 to 400 N",
    )
