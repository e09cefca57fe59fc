"""Settings of the diagnosis, each with its reason."""

import math
from dataclasses import dataclass, field

from solver.common.settings_field import setting
from solver.dynamics.force_prediction.marker_noise import MarkerNoise


@dataclass(frozen=True)
class DiagnosisSettings:
    """What counts as noise, what as model error, and from where on something is said to be wrong."""

    markers: MarkerNoise = field(default_factory=MarkerNoise)
    signature_cutoff_Hz: float = setting(
        20.0, unit="Hz", why="signatures are computed from motion below it: above, accelerations are noise"
    )
    most_rows: int = setting(2400, unit="", why="the evidence is a dense matrix; longer trials hop farther")
    force_noise_N: float = setting(
        2.0, unit="N", why="of a filtered plate; white noise of raw ones comes on top (`plate_noise`)"
    )
    moment_noise_Nm: float = setting(
        1.3, unit="N·m", why="likewise: 2 mm of centre of pressure at body weight"
    )
    body_mass_std: float = setting(0.008, unit="", why="relative: a scale's reading, clothes and shoes")
    segment_mass_std: float = setting(
        0.06, unit="", why="relative scatter of segments' masses between people"
    )
    segment_com_std_m: float = setting(0.008, unit="m", why="scatter of their centres of mass, and of joints")
    tissue_std_m_per_rad: float = setting(
        0.008, unit="m/rad", why="how far a segment's markers slide together as the joints beside it turn"
    )
    most_effects: int = setting(
        5, unit="", why="a recording with more causes than that is better recorded anew"
    )
    least_gain: float = setting(8.0, unit="nats", why="of log evidence; clean recordings rarely reach it")
    most_evaluations: float = setting(
        8e6,
        unit="rows",
        least=0.0,
        why="of the balance, fitted with sets of causes at pairs of scales; then the search ends with what "
        "held up so far and says so. The longest known takes 6e6; counted, not timed: the same files always "
        "get the same answer",
    )
    handicaps: tuple[tuple[str, float], ...] = setting(
        (),
        unit="cause, nats",
        least=-math.inf,
        why="log prior odds against causes that are rare, or that generic models imitate on sound "
        "recordings, in place of those that stand beside the cause (docs/reference/causes.md)",
    )
    outside_odds: float = setting(
        0.2,
        unit="",
        why="how likely a fault is on no list, before the balance: of real recordings whose fault was found "
        "by other means, too few are counted yet to say more",
    )
    certain_gain: float = setting(
        40.0, unit="nats", why="from which on something is wrong even if several causes would do"
    )
    least_confidence: float = setting(
        0.2, unit="", why="of a smaller gain; model errors of real recordings suit many causes equally badly"
    )
