"""Settings of the clock behind a time column."""

from dataclasses import dataclass

from solver.common.settings_field import setting


@dataclass(frozen=True)
class ClockSettings:
    """What counts as a uniform clock."""

    finest_decimals: int = setting(
        9, unit="", why="time columns are printed with at most so many decimals; beyond is float noise"
    )
    jitter: float = setting(
        0.05, unit="samples", why="how far a time may be off beyond its rounding: clocks are that good"
    )
    largest_jitter: float = setting(
        0.45,
        unit="samples",
        why="rows off the uniform clock by less are moved onto it; from half on, their order is a guess",
    )
    rate_tolerance: float = setting(
        5e-4, unit="", why="header and time column that differ by less say the same"
    )
    fewest_jittering: int = setting(
        10, unit="rows", why="that jitter about a clock: fewer may fit a clock by chance"
    )
    single_steps: float = setting(
        0.8, unit="", why="share of steps by one sample in a recording that jitters; events come at any time"
    )
    gap_limit: float = setting(
        10.0, unit="", why="missing rows per present row; with more, two recordings are in one file"
    )


CLOCK = ClockSettings()
