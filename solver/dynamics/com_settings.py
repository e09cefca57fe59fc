"""Settings of the centre-of-mass trajectory and of the mass that it tells, each with its reason."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from solver.common.settings_field import setting


@dataclass(frozen=True)
class ComSettings:
    """How far the trajectory trusts markers, forces, and the mass that somebody entered."""

    alpha_s2: float = setting(
        1e-3,
        unit="s²",
        why="regularization α of the accelerations where a force is missing, a low-pass at "
        "1/(2π √α) = 5 Hz: of 1.5 to 15 Hz the best at predicting hidden steps of five walks, a run, a squat",
    )
    com_error_m: float = setting(
        0.01, unit="m", why="of the centre of mass from markers: soft tissue and the model's segment masses"
    )
    force_error_m_s2: float = setting(
        0.2,
        unit="m/s²",
        why="acceleration error from plates and model, 2 % of g: markers lead below 0.7 Hz, so that long "
        "trials don't drift; 0.1 to 1 predict hidden steps alike, 0 (z̈ = μ f − g exactly) half as well",
    )
    window_s: float = setting(
        0.3,
        unit="s",
        why="force and motion are held against each other as averages over it: three times what the 5 Hz "
        "low-pass spreads, half a step",
    )
    imbalance: float = setting(
        0.15,
        unit="",
        why="of the greatest force required around it, at least body weight: a window off by more tells "
        "nothing about the mass; measured steps of all kinds stay below it, a foot beside the plates above",
    )
    start_share: float = setting(
        0.5,
        unit="",
        why="the search for the mass starts from the greatest that balances half as many frames as the best: "
        "a missing foot makes windows too light, never too heavy",
    )
    block_s: float = setting(
        0.5, unit="s", why="errors within a block of this length count as one: about a step"
    )
    noise_time_s: float = setting(
        0.03,
        unit="s",
        why="one independent error of the centre of mass in so long; from simulated errors that last "
        "0.02 to 1 s, of which the trajectory itself takes up the slow part",
    )
    plate_gain_std: float = setting(
        0.015,
        unit="",
        why="of the mass: mounting spoils a plate's calibration (Collins et al. 2009), and nothing inside a "
        "recording shows it; one person's mass differs by 2 to 5 % between recordings",
    )
    entered_mass_std_kg: float = setting(
        1.0, unit="kg", why="clothes, shoes and markers, and a scale read on another day"
    )
    disagreement: float = setting(
        2.0, unit="", why="standard deviations from which two masses are said to disagree: one in twenty"
    )

    def penalty_s2(self, observed: Bool[np.ndarray, " frames"]) -> Float[np.ndarray, " frames"]:
        """Weight of a frame's acceleration against a position [s²]: α where the force is missing.

        Elsewhere the ratio of the two errors; infinite where z̈ = μ f − g is to hold exactly.
        """
        trust = self.com_error_m / self.force_error_m_s2 if self.force_error_m_s2 > 0 else np.inf
        return np.where(observed, trust, self.alpha_s2)
