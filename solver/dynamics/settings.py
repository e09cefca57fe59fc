"""Settings of inverse dynamics, each with its reason."""

from dataclasses import dataclass

from solver.settings_field import setting


@dataclass(frozen=True)
class DynamicsSettings:
    """How motion and forces are smoothed alike, and which frames the figures leave out."""

    cutoff_Hz: float | None = setting(
        30.0,
        unit="Hz",
        why="low-pass of motion and forces alike (Werling et al. 2024, supplement)",
    )
    filter_order: int = setting(3, unit="", why="of the single pass, for motion and forces alike (likewise)")
    end_frames: int = setting(
        10,
        unit="frames",
        why="left out of the figures at each end of a trial: spline and filter know no motion beyond it, "
        "and accelerations there are off by 15 to 400 N",
    )
