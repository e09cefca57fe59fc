"""Thresholds of plate assignment and contact phases, each with its reason."""

from dataclasses import dataclass

from solver.common.settings_field import setting

SHORTEST_CONTACT_S = 0.05  # shorter ones are noise; a sprinter's lasts 0.09 s


@dataclass(frozen=True)
class ContactSettings:
    """Which foot a plate's force belongs to, and when a foot stands on the ground."""

    farthest_m: float = setting(
        0.25, unit="m", why="a centre of pressure farther from every sole is no foot's: about a foot's length"
    )
    touch_height_m: float = setting(
        0.04, unit="m", why="sole corners no higher than this above their loaded height may touch the ground"
    )
    touch_speed_m_s: float = setting(
        0.8, unit="m/s", why="a touching sole creeps while the foot rolls; a swinging one passes at 2 m/s"
    )
