"""What is known of force plates and people before a recording is looked at."""

from dataclasses import dataclass

from solver.common.settings_field import setting


@dataclass(frozen=True)
class PlateSignSettings:
    """What is known of plates and people beforehand, and what counts as clear."""

    clear_nats: float = setting(
        8.0,
        unit="nats",
        why="by which a sign or a zero level must be ahead: a constant reading of one plate gets 7 from what "
        "is usual alone, and that must not turn it",
    )
    used_N: float = setting(
        40.0,
        unit="N",
        why="a plate that reads less and changes by less carried nobody: nothing tells its sign",
    )
    window_s: float = setting(
        0.2,
        unit="s",
        why="of the smoothing that forces and accelerations share; steps last three times as long",
    )
    spacing_s: float = setting(
        0.1, unit="s", why="of the samples that count: half a window apart their errors are independent"
    )
    most_samples: int = setting(
        120, unit="", why="evenly spread over the recording; more would only give false certainty"
    )
    noise_N: float = setting(4.0, unit="N", why="of the plates' smoothed sum: amplifiers, vibration of belts")
    gain_error: float = setting(0.02, unit="", why="plates weigh within 1 to 3 % of each other")
    acceleration_floor: float = setting(
        0.1, unit="m/s²", why="error of the trunk's acceleration in quiet standing: markers' noise, breathing"
    )
    acceleration_share: float = setting(
        0.15,
        unit="",
        why="of its size nearby, by which it errs: two thirds of the samples of 13 fully measured walks, "
        "runs, squats and landings are within",
    )
    trunk_share: float = setting(
        0.8,
        unit="",
        why="of the trunk's acceleration that the centre of mass makes: 0.6 in squats and landings, 0.9 in "
        "walking and running",
    )
    trunk_spread: float = setting(0.15, unit="", why="and how much that differs between motions")
    trunk_least: float = setting(
        0.45,
        unit="",
        why="no motion that we measured leaves the centre of mass less; it never goes the other way",
    )
    trunk_most: float = setting(1.1, unit="", why="and none makes it move more than the trunk but by errors")
    acceleration_unknown: float = setting(
        3.0, unit="m/s²", why="size of the centre of mass's in brisk walking, where no marker tells it"
    )
    tare_N: float = setting(15.0, unit="N", why="what taring leaves, and ringing of filters")
    level_known_N: float = setting(
        40.0,
        unit="N",
        why="a zero level that is not known better is not taken off; smaller ones are a tare's rest",
    )
    held_s: float = setting(
        0.05,
        unit="s",
        why="six numbers that a loaded plate never repeats for so long: set to zero by a program",
    )
    rest_s: float = setting(
        0.1, unit="s", why="for which a plate rests at its zero level, to measure all of it"
    )
    usual_mass_kg: float = setting(68.0, unit="kg", why="adults' median; it decides between extremes only")
    usual_mass_spread: float = setting(
        0.4, unit="", why="of the logarithm: 19 of 20 people are between 31 and 149 kg"
    )
    entered_mass_spread: float = setting(
        0.08, unit="", why="of an entered mass: clothes, devices, carried loads, rounding"
    )
    all_turned: float = setting(
        0.1, unit="", why="recordings that hold the forces on the plates: a common convention"
    )
    some_turned: float = setting(
        0.02, unit="", why="recordings whose plates differ in sign: a channel or corners gone wrong"
    )
    untared: float = setting(0.02, unit="", why="plates that were tared under a load, or not at all")
    untared_range_N: float = setting(3000.0, unit="N", why="their zero levels may lie anywhere within")
    outlier: float = setting(
        1e-3, unit="", why="samples that nothing explains: glitches, a swapped marker, crosstalk"
    )


PLATE_SIGN = PlateSignSettings()
