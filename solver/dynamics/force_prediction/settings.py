"""Settings of predicting, each with its reason."""

from dataclasses import dataclass

from solver.common.settings_field import setting


@dataclass(frozen=True)
class PredictionSettings:
    """How a second fit learns what the body model gets wrong, for frames whose force nobody knows."""

    enabled: bool = setting(True, unit="", why="false predicts missing forces by the reported motion alone")
    smoothness: float = setting(
        500.0,
        unit="1/s",
        why="of its trajectory: accelerations of the whole body are to be free of markers' noise; "
        "what that bends repeats with the steps and is learnt. 300 to 1000 predict alike",
    )
    marker_slow_m: float = setting(
        0.0056, unit="m", why="at least, of its markers: they follow where the forces call them"
    )
    marker_growth_m: float = setting(
        0.01, unit="m/√s", why="at least, likewise: 1 mm from frame to frame at 100 Hz"
    )
    shared_growth: float = setting(
        0.0, unit="", why="likewise: of no say beside such a smoothness", least=0.0
    )
    residual_force_std_N: float = setting(
        4.0, unit="N", why="of its residual: what the model gets wrong is learnt, and the plates are left"
    )
    residual_moment_std_Nm: float = setting(
        5.0, unit="N·m", why="likewise: under a centimetre at body weight"
    )
    knot_spacing_s: float = setting(0.02, unit="s", why="such a trajectory needs no closer knots")
    inertia_prior_weight: float = setting(
        0.1,
        unit="",
        why="times the trajectory fit's, where hidden blocks ask for it: nobody reads these inertias, and "
        "moments of a short recording are missed by a quarter less; of legs alone they are missed by more",
    )
    clear_margin: float = setting(
        0.03,
        unit="",
        why="share by which a kind of term has to lower the error on hidden blocks: less is chance where "
        "steps are few",
    )
    most_worse: float = setting(
        0.05, unit="", why="share by which a set may be worse than none on any trial, or it stays off"
    )
    agreement: float = setting(
        1.65,
        unit="",
        least=0.0,
        why="standard errors by which hidden blocks have to agree that it is lower, the end of a 90 % "
        "interval: else one impact decides",
    )
    kinds_last: float = setting(
        0.4,
        unit="",
        why="share of the known frames that edits of the flags may change before hidden blocks choose kinds "
        "anew: choosing takes three times as long as all the rest of a re-solve",
    )
    demand_cutoff_Hz: float = setting(
        8.0, unit="Hz", why="the motion's own demand is taken below it: above, marker noise dominates"
    )
    gain_std: float = setting(
        0.1,
        unit="",
        why="of the share by which the demand is off, axis by axis: masses and their centres",
    )
    lag_std_s: float = setting(0.01, unit="s", why="of the time by which it is late: soft tissue, filters")
    damping_std_s2: float = setting(
        1.76e-4, unit="s²", why="of its second derivative's share: (2π·12 Hz)⁻², a loss of half at 12 Hz"
    )
    phase_knots: int = setting(
        14, unit="", why="of a curve over a step: 40 ms apart in walking, as long as what repeats"
    )
    phase_force_share: float = setting(
        0.025, unit="", why="scatter of a curve's coefficients over the peak force: 20 N in a walk of 75 kg"
    )
    phase_arm_m: float = setting(
        0.004,
        unit="m",
        why="scatter of a moment curve's coefficients over the peak force: 3 N·m there",
    )
    shortest_stride_m: float = setting(
        0.15, unit="m", why="a foot that swings forward by less, seen from the pelvis, takes no step"
    )
    step_change: float = setting(
        1.6, unit="", why="a step that lasts so many times the usual one, or less than its inverse, is none"
    )
    constant_force_share: float = setting(
        0.014,
        unit="",
        why="scatter of a constant force over body weight: 10 N at 75 kg; zero levels",
    )
    constant_arm_m: float = setting(
        0.02, unit="m", why="scatter of a constant moment over body weight: 15 N·m, trunk's centre of mass"
    )
    notable_gain: float = setting(0.03, unit="", why="from which on a learnt gain is noted: a plate's, say")
    notable_lag_s: float = setting(0.003, unit="s", why="from which on a lag is noted: a late clock, say")

    @property
    def most_columns(self) -> int:
        """Parameters of all kinds together; what memory has to hold beside the trajectory fit's own."""
        return 6 * self.phase_knots + 18 + 6 if self.enabled else 0
