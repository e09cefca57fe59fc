"""Settings of reading and conditioning forces, each with its reason."""

from dataclasses import dataclass

from solver.common.filters import ORDER
from solver.common.plate_figures import CONTACT_N, JUDGED_N, UNTARED_SHARE
from solver.common.settings_field import setting


@dataclass(frozen=True)
class ForceTableSettings:
    """How the columns of a force table (.mot, .sto) are judged."""

    loaded_N: float = setting(
        JUDGED_N, unit="N", why="levers are judged above it: 5 N of noise are then 10 % of the force"
    )
    centre_known_N: float = setting(
        CONTACT_N, unit="N", why="below it centres of pressure are noise and are not reported"
    )
    fewest_samples: int = setting(10, unit="samples", why="loaded ones that a judgement on moments needs")
    good_lever_m: float = setting(
        0.02, unit="m", why="a moment convention that leaves more than half a foot's width explains nothing"
    )
    plate_handicap_m: float = setting(
        0.001, unit="m", least=0.0, why="a fitted plate origin must do better by this than what needs no fit"
    )
    height_weight: float = setting(
        0.01,
        unit="",
        least=0.0,
        why="of 'the origin lies at the surface': its height shows in the shear force only",
    )
    usable_centre_m: float = setting(
        0.3, unit="m", why="an unloaded centre of pressure farther from all loaded ones is noise"
    )
    smallest_load_N: float = setting(
        50.0,
        unit="N",
        why="somebody's foot presses more at some time; less as a file's peak is kN, body weights or N/kg",
    )
    longest_lab_m: float = setting(50.0, unit="m", why="levers longer than a laboratory are in mm")
    largest_free_Nm: float = setting(
        500.0, unit="N·m", why="free moments are below 50 N·m; a median beyond this is in N·mm"
    )


@dataclass(frozen=True)
class ConditioningSettings:
    """How forces are cleaned and filtered."""

    cutoff_Hz: float = setting(
        30.0,
        unit="Hz",
        why="the dataset paper's; in walking 20 to 50 Hz hardly matters",
    )
    nyquist_share: float = setting(
        0.8,
        unit="",
        below=1.0,
        why="of the markers' Nyquist frequency, that the cutoff stays below: noise folds beyond",
    )
    order: int = setting(ORDER, unit="", why="of the single pass; likewise the paper's")
    threshold_N: float = setting(
        CONTACT_N,
        unit="N",
        why="gait laboratories' usual contact threshold, four noise deviations of a treadmill",
    )
    shortest_contact_s: float = setting(
        0.03,
        unit="s",
        least=0.0,
        why="a running step lasts three times as long; shorter bursts are vibration",
    )
    longest_gap_s: float = setting(
        0.02,
        unit="s",
        least=0.0,
        why="a line bridges 20 ms of a 30 Hz signal; longer gaps count as not observed",
    )
    largest_N: float = setting(
        20_000.0,
        unit="N",
        why="landings and long jumps stay below 12 kN a foot; beyond is a spike or an overflow",
    )
    zero_largest_N: float = setting(
        40.0,
        unit="N",
        why="zero levels are some newtons; a foot at rest on the plate while sitting weighs more",
    )
    zero_share: float = setting(
        UNTARED_SHARE, unit="", why="a fifth of the plate's greatest force is a load, not a zero level"
    )
    zero_noise_N: float = setting(
        10.0, unit="N", why="an unloaded plate stays this close to its level: amplifier noise, belt vibration"
    )
    zero_bin_N: float = setting(
        2.0, unit="N", why="of the histogram in which the level is looked for: the noise of a quiet plate"
    )
    zero_stretch_s: float = setting(
        0.05, unit="s", why="and for so long; loading and unloading cross 20 N within 10 ms"
    )
    zero_flat_share: float = setting(
        0.8,
        unit="",
        why="of the time with little load, that a level below zero must hold: a bias does for nine tenths, "
        "what a low-pass of 3 to 6 Hz leaves between steps for three quarters at most",
    )
    zero_smallest_N: float = setting(
        1.0, unit="N", least=0.0, why="smaller offsets are noise of their own estimate"
    )
    zero_drift_N: float = setting(
        3.0, unit="N", why="a zero level that moves by more from the first to the last stretch is reported"
    )
    uneven_m: float = setting(
        0.01,
        unit="m",
        why="centres of pressure whose height varies by more tell of a ramp, not of a plate out of level",
    )
    flat_m: float = setting(
        0.003, unit="m", why="and so well must a plane describe them, or the surface counts as level"
    )


FORCE_TABLES = ForceTableSettings()
CONDITIONING = ConditioningSettings()
