"""Numbers of the search for unnamed markers, each with its reason."""

from dataclasses import dataclass


@dataclass(frozen=True)
class UnnamedSettings:
    """How markers without a name are found on the default body."""

    # weights of landmarks before anything is seen: what people put markers on
    bony: float = 1.0
    soft: float = 0.3
    cluster: float = 0.5
    centre: float = 0.1  # few recordings hold computed joint centres
    elsewhere: float = 1e-4  # density of a marker that is on no landmark, against one 5 cm wide
    unsupported: float = 0.03  # chance of a hand with no marker on the forearm, and the like
    one_sided: float = 0.3  # likewise of a place whose twin on the other side carries none
    shared: float = 0.02  # likewise of a place that another marker has

    headings: int = 8  # of the first guesses; an eighth of a turn is well within reach of the alignment
    # of the stature: where the highest marker is, on the head, the shoulders, or the waist
    highest: tuple[float, ...] = (1.0, 0.84, 0.60)
    plausible_size: tuple[float, float] = (0.5, 1.25)  # against the default body: small children to giants
    height_m: float = 1.70  # of people, and the scatter of its logarithm
    height_scatter: float = 0.09
    reference_shares: tuple[float, ...] = (1.0, 0.7, 0.3)  # frames by how upright: these start the search
    widths_m: tuple[float, ...] = (
        0.15, 0.137, 0.124, 0.111, 0.099, 0.086, 0.073, 0.06, 0.06, 0.055, 0.05, 0.045, 0.04, 0.035, 0.03,
    )  # fmt: skip  # the mixture narrows: from a coarse likeness of a body to marker places
    coarse_widths: int = 8  # after so many only the better half of the guesses is followed
    followed: int = 48
    posture_std_rad: float = 0.6  # about the start posture, while one frame is all there is
    most_turn_rad: float = 0.5  # in one step

    guesses: int = 5  # different ones that are tried on the whole recording
    differ_share: float = 0.1  # of the markers, on other bodies: then two guesses are different
    frames: int = 24  # of the recordings together
    well_seen: float = 0.8  # of the most markers that any frame shows
    rounds: int = 8  # of pose and attachment in turn
    # [m] deviation of a marker from its place on a body: at first, when poses are rough, and at last
    loose_m: float = 0.04
    rigid_m: float = 0.015
    proportions_m: float = 0.03  # how far proportions move places, before segments are scaled, and after
    scaled_proportions_m: float = 0.015
    independent_frames: float = 6.0  # soft tissue repeats: so many frames' worth is in a recording
    pull_std_rad: float = 1.0  # to the default posture
    robust_m: float = 0.07
    limit_std_rad: float = 0.09
    walks_m: float = 0.5  # who travels further than that, mostly travels forwards:
    forwards_log_odds: float = 3.0

    rivals: int = 3  # guesses that are scaled and compared at the end
    temper: float = 5.0  # of the comparison: markers of one body are no independent witnesses
    # a marker on the next body, the poses fitted with it there: temper of that comparison, the odds at most
    # (what was found first is likelier), how far off a landmark of it may be, and markers on no body at all
    neighbour_temper: float = 2.0
    neighbour_most: float = 0.8
    neighbour_reach_m: float = 0.08
    least_weighed: float = 0.05
    believed: float = 0.25  # understandings less likely than this are not looked at so closely
    sure_landmark: float = 0.6  # of the marker's share on its body: then it is called by the landmark
    place_std_m: float = 0.03  # of a place that was measured, not read from the atlas
    fewest_markers: int = 16  # without any name; fewer were fitted to a stranger shape with confidence
    fewest_bodies: int = 5
    sure_share: float = 0.7  # of the markers that must find a body, or it is none


SETTINGS = UnnamedSettings()
