"""Thresholds of gait events and cycles."""

from dataclasses import dataclass

from solver.common.plate_figures import CONTACT_N
from solver.common.settings_field import setting


@dataclass(frozen=True)
class GaitSettings:
    """When a foot counts as standing, from forces and from its motion.

    Values "by recordings" were chosen on 15 walks and runs; benchmarks/GAIT.md judges them, on others too.
    """

    threshold_N: float = setting(
        CONTACT_N, unit="N", why="vertical force of a contact; the field's usual bound"
    )
    shortest_contact_s: float = setting(
        0.06, unit="s", why="sprinters stand for 0.09 s, vibration is shorter"
    )
    least_peak_N: float = setting(150.0, unit="N", why="a plate that is hardly touched carries no step")
    gap_s: float = setting(
        0.03,
        unit="s",
        why="a foot that goes from plate to plate is on both or leaves one as it takes the other",
    )
    cutoff_Hz: float = setting(15.0, unit="Hz", why="of the feet's motion; 10 to 20 Hz change events by 5 ms")
    steps_per_s: float = setting(500.0, unit="1/s", why="on which the feet's spline is read; 2 ms")
    low_m: float = setting(
        0.02, unit="m", why="the part of a sole that may touch: this near its lowest corner"
    )
    contact_share: float = setting(
        0.4, unit="", why="of pace, below which a landing sole slips; by recordings"
    )
    most_contact_m_s: float = setting(
        2.4, unit="m/s", why="which landing feet of runners reach; by recordings"
    )
    off_factor: float = setting(
        0.8, unit="", why="slip of a leaving toe is this times pace to off_power, in m/s; by recordings"
    )
    off_power: float = setting(
        0.7, unit="", why="runners' toes leave at a smaller share of their pace; likewise"
    )
    least_slip_m_s: float = setting(
        0.2, unit="m/s", why="soft tissue and the filter move standing feet so fast"
    )
    edge_s: float = setting(
        0.06, unit="s", why="of a recording's beginning, in which a filtered foot may seem to land"
    )
    shortest_swing_s: float = setting(0.08, unit="s", why="shorter stops between stances are noise")
    surface_low_share: float = setting(
        0.35, unit="", why="of the time, in which a foot is lowest: it then stands, also in runs"
    )
    surface_spread_m_s: float = setting(
        0.2, unit="m/s", why="by which standing soles differ from the surface"
    )
    surface_window_s: float = setting(
        0.35, unit="s", why="over which a belt keeps its speed; about half a step"
    )
    flat_from: float = setting(0.2, unit="", why="of a stance, from which the whole sole lies on the surface")
    flat_to: float = setting(0.55, unit="", why="of a stance, until which it does; runners' heels then rise")
    belt_window_s: float = setting(0.5, unit="s", why="over which stances are averaged for a belt's speed")
    still_m_s: float = setting(0.15, unit="m/s", why="a slower surface stands still: no belt is so slow")
    pace_window_s: float = setting(1.0, unit="s", why="about a stride of a walk")
    walking_m_s: float = setting(
        0.2, unit="m/s", why="people who walk at home alone go 0.2 to 0.4 m/s; slower, no cycle counts"
    )
    longest_cycle_s: float = setting(
        2.5, unit="s", why="slow walks of patients reach 2 s; beyond, a step is missing"
    )


GAIT = GaitSettings()
