"""How far markers may stray from bones, where their motion alone is asked about: its settings."""

from dataclasses import dataclass

from solver.common.settings_field import setting


@dataclass(frozen=True)
class MarkerNoise:
    """How far markers stray from the bones, in shares of what they stray from the fitted model."""

    own_share: float = setting(0.5, unit="", why="of one marker against its segment's others")
    shared_share: float = setting(
        0.6, unit="", why="soft tissue moves a segment's markers together, unseen by the fit"
    )
    least_m: float = setting(0.0003, unit="m", why="of the best cameras")
    time_s: float = setting(
        0.1, unit="s", why="correlation time: errors change by their own size in 0.06 to 0.1 s"
    )
    white_share: float = setting(1.0, unit="", why="of the white noise that changes from frame to frame tell")
    white_Hz: float = setting(
        10.0,
        unit="Hz",
        why="at which it counts for as much as it is: slower, skin outweighs it; faster, windows average it "
        "away. Of 6 to 22, sound recordings with 1 and 2 mm are likeliest so",
    )
    memory_s: float = setting(1.0, unit="s", why="wrenches farther apart share no marker's error")
    smoothness: tuple[float, ...] = setting(
        (5.0, 15.0, 50.0, 150.0, 500.0, 1500.0),
        unit="1/s",
        why="of ∫(jerk/level)² dt, between which a trial's markers choose: 5 is a jerk of that level in a "
        "band of 40 Hz, as heel strikes need; in a squat the level is mostly the markers' noise, and with 5 "
        "that noise would be motion",
    )
    knot_spacing_s: float = setting(
        0.02, unit="s", why="what wrenches' windows tell needs no closer knots, and half as many cost half"
    )
    iterations: int = setting(3, unit="", why="of Gauss-Newton from inverse kinematics; two settle")
