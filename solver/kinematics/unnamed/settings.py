"""Numbers of the search for unnamed markers, each with its reason."""

from dataclasses import dataclass, field

from solver.common.settings_field import setting
from solver.kinematics.settings import KinematicsSettings


@dataclass(frozen=True)
class UnnamedSettings:
    """How markers without a name are found on the default body."""

    bony: float = setting(1.0, unit="", why="weight of a bony landmark before anything is seen: most used")
    soft: float = setting(0.3, unit="", why="likewise of a place on soft tissue")
    cluster: float = setting(0.5, unit="", why="likewise of a place somewhere on a segment")
    centre: float = setting(
        0.1, unit="", why="likewise of a joint's centre: few recordings hold computed ones"
    )
    elsewhere: float = setting(
        1e-4, unit="", why="density of a marker that is on no landmark, against one 5 cm wide"
    )
    unsupported: float = setting(
        0.03, unit="", why="chance of a hand with no marker on the forearm, and the like"
    )
    one_sided: float = setting(
        0.3, unit="", why="chance of a place whose counterpart on the other side carries no marker"
    )
    shared: float = setting(0.02, unit="", why="chance of a place that another marker has")
    headings: int = setting(
        8, unit="", why="of the first guesses; an eighth of a turn is well within reach of the alignment"
    )
    highest: tuple[float, ...] = setting(
        (1.0, 0.84, 0.60),
        unit="",
        why="of the stature: where the highest marker is, on the head, the shoulders, or the waist",
    )
    plausible_size: tuple[float, float] = setting(
        (0.5, 1.25), unit="", why="against the default body: small children to giants"
    )
    height_m: float = setting(1.70, unit="m", why="mean stature of people")
    height_scatter: float = setting(0.09, unit="", why="of the logarithm of people's stature")
    reference_shares: tuple[float, ...] = setting(
        (1.0, 0.7, 0.3), unit="", why="frames by how upright they are: these start the search"
    )
    widths_m: tuple[float, ...] = setting(
        (0.15, 0.137, 0.124, 0.111, 0.099, 0.086, 0.073, 0.06, 0.06, 0.055, 0.05, 0.045, 0.04, 0.035, 0.03),
        unit="m",
        why="the mixture narrows: from a coarse likeness of a body to marker places",
    )
    coarse_widths: int = setting(
        8, unit="", why="after so many only the better half of the guesses is followed"
    )
    followed: int = setting(48, unit="", why="guesses that go on after the coarse widths")
    posture_std_rad: float = setting(
        0.6, unit="rad", why="about the start posture, while one frame is all there is"
    )
    most_turn_rad: float = setting(0.5, unit="rad", why="in one step: larger ones leave the linear range")
    guesses: int = setting(5, unit="", why="different ones that are tried on the whole recording")
    differ_share: float = setting(
        0.1, unit="", why="of the markers, on other bodies: then two guesses are different"
    )
    frames: int = setting(24, unit="", why="of the recordings together: more change no answer")
    well_seen: float = setting(0.8, unit="", why="of the most markers that any frame shows")
    rounds: int = setting(8, unit="", why="of pose and attachment in turn")
    loose_m: float = setting(
        0.04, unit="m", why="deviation of a marker from its place on a body at first, when poses are rough"
    )
    rigid_m: float = setting(0.015, unit="m", why="likewise at last: soft tissue and placement")
    proportions_m: float = setting(
        0.03, unit="m", why="how far proportions move places, before segments are scaled"
    )
    scaled_proportions_m: float = setting(0.015, unit="m", why="likewise after segments are scaled")
    independent_frames: float = setting(
        6.0, unit="frames", why="soft tissue repeats: so many frames' worth is in a recording"
    )
    pull_std_rad: float = setting(1.0, unit="rad", why="to the default posture")
    robust_m: float = setting(0.07, unit="m", why="beyond it a marker loses influence on the pose")
    limit_std_rad: float = setting(
        KinematicsSettings.limit_std_rad, unit="rad", why="5°: soft joint limits, as in the kinematics"
    )
    walks_m: float = setting(0.5, unit="m", why="who travels further than that, mostly travels forwards")
    forwards_log_odds: float = setting(3.0, unit="nats", least=0.0, why="that who travels, travels forwards")
    rivals: int = setting(3, unit="", why="guesses that are scaled and compared at the end")
    temper: float = setting(
        5.0, unit="nats", why="of the comparison: markers of one body are not independent evidence"
    )
    neighbour_temper: float = setting(
        2.0,
        unit="nats",
        why="of the comparison with a marker on the next body, the poses fitted with it there",
    )
    neighbour_most: float = setting(
        0.8, unit="", why="odds of the next body at most: what was found first is likelier"
    )
    neighbour_reach_m: float = setting(0.08, unit="m", why="how far off a landmark of the next body may be")
    least_weighed: float = setting(
        0.05, unit="", why="belief in a body below which its neighbours are not tried"
    )
    believed: float = setting(
        0.25, unit="", why="solutions less likely than this are not examined so closely"
    )
    sure_landmark: float = setting(
        0.6, unit="", why="of the marker's share on its body: then it is called by the landmark"
    )
    place_std_m: float = setting(0.03, unit="m", why="of a place that was measured, not read from the atlas")
    fewest_markers: int = setting(
        16, unit="", why="without any name; fewer were fitted to a wrong shape with confidence"
    )
    fewest_bodies: int = setting(5, unit="", why="with a sure marker; fewer are no person")
    sure_share: float = setting(0.7, unit="", why="of the markers that must find a body, or it is none")


@dataclass(frozen=True)
class NamingSettings:
    """What finding out which label is which marker obeys."""

    unnamed: UnnamedSettings = field(default_factory=UnnamedSettings)
    kinematics: KinematicsSettings = field(default_factory=KinematicsSettings)


NAMING = NamingSettings()
