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
    between_feet_m: float = setting(
        0.02, unit="m", why="so far outside both soles, but between them, a centre of pressure shows two feet"
    )
    smaller_share: float = setting(
        0.1, unit="", why="and so far on the way from one to the other: real steps on one plate stay below it"
    )
    share_if_carried: float = setting(
        0.25, unit="", why="likewise while another plate carries one of the two: a roll-off reaches 0.18"
    )
    takeover_m_s: float = setting(
        0.004,
        unit="m·s",
        why="another foot takes a loaded plate over by being 5 cm nearer for 80 ms",
    )
    full_weight_load: float = setting(
        0.2, unit="", why="of the plate's peak force: from there the centre of pressure is trusted in full"
    )
    lying_std_N: float = setting(
        5.0, unit="N", why="what lies on a plate all along, or its offset, changes less; a person sways more"
    )
    touch_height_m: float = setting(
        0.04, unit="m", why="sole corners no higher than this above their loaded height may touch the ground"
    )
    touch_speed_m_s: float = setting(
        0.8,
        unit="m/s",
        why="a touching sole creeps while the foot rolls; a swinging one passes at 2 m/s",
    )
    shortest_standing_s: float = setting(
        0.1, unit="s", why="of loaded frames from which a foot's height above the ground is learnt"
    )
    shortest_phase_s: float = setting(
        SHORTEST_CONTACT_S,
        unit="s",
        least=0.0,
        why="shorter touches are markers' noise; a sprinter's contact lasts 0.09 s",
    )
    shortest_gap_s: float = setting(
        0.03,
        unit="s",
        least=0.0,
        why="shorter lifts inside a contact phase are noise; a running flight lasts 0.08 s",
    )
