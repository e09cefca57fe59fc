"""Settings of predicting, each with its reason."""

from dataclasses import dataclass

from solver.common.settings_field import setting

PHASE_KNOTS = 14  # of a curve over a step: 40 ms apart in walking, as long as what repeats


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
    residual_force_std_N: float = setting(
        4.0, unit="N", why="of its residual: what the model gets wrong is learnt, and the plates are left"
    )
    residual_moment_std_Nm: float = setting(
        5.0, unit="N·m", why="likewise: under a centimetre at body weight"
    )
    knot_spacing_s: float = setting(0.02, unit="s", why="such a trajectory needs no closer knots")
    gain_std: float = setting(
        0.1, unit="", why="of the share by which the demand is off, axis by axis: masses and their centres"
    )
    lag_std_s: float = setting(0.01, unit="s", why="of the time by which it is late: soft tissue, filters")

    @property
    def most_columns(self) -> int:
        """Parameters of all kinds together; what memory has to hold beside the trajectory fit's own."""
        return 6 * PHASE_KNOTS + 18 + 6 if self.enabled else 0
