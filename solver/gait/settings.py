"""Thresholds of gait events and cycles."""

from dataclasses import dataclass

from solver.common.plate_figures import CONTACT_N
from solver.common.settings_field import setting

STEPS_PER_S = 500.0  # [1/s] on which the feet's spline is read; 2 ms
FLAT_FROM = 0.2  # of a stance, from which the whole sole lies on the surface
FLAT_TO = 0.55  # of a stance, until which it does; runners' heels then rise


@dataclass(frozen=True)
class GaitSettings:
    """When a foot counts as standing, from forces and from its motion.

    Values "by recordings" were chosen on 15 walks and runs; benchmarks/GAIT.md judges them, on others too.
    """

    threshold_N: float = setting(
        CONTACT_N, unit="N", why="vertical force of a contact; the field's usual bound"
    )
    least_peak_N: float = setting(150.0, unit="N", why="a plate that is hardly touched carries no step")
    cutoff_Hz: float = setting(15.0, unit="Hz", why="of the feet's motion; 10 to 20 Hz change events by 5 ms")


GAIT = GaitSettings()
