"""Settings of reading and conditioning forces, each with its reason."""

from dataclasses import dataclass

from solver.common.filters import ORDER
from solver.common.plate_figures import CONTACT_N
from solver.common.settings_field import setting


@dataclass(frozen=True)
class ConditioningSettings:
    """How forces are cleaned and filtered."""

    cutoff_Hz: float = setting(
        30.0, unit="Hz", why="the dataset paper's; in walking 20 to 50 Hz hardly matters"
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
    zero_noise_N: float = setting(
        10.0, unit="N", why="an unloaded plate stays this close to its level: amplifier noise, belt vibration"
    )


CONDITIONING = ConditioningSettings()
