"""Settings of the centre-of-mass trajectory and of the mass that it tells, each with its reason."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from solver.common.settings_field import setting

BLOCK_S = 0.5  # [s] errors within a block of this length count as one: about a step


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
    plate_gain_std: float = setting(
        0.015,
        unit="",
        why="of the mass: mounting spoils a plate's calibration (Collins et al. 2009), and nothing inside a "
        "recording shows it; one person's mass differs by 2 to 5 % between recordings",
    )
    entered_mass_std_kg: float = setting(
        1.0, unit="kg", why="clothes, shoes and markers, and a scale read on another day"
    )

    def penalty_s2(self, observed: Bool[np.ndarray, " frames"]) -> Float[np.ndarray, " frames"]:
        """Weight of a frame's acceleration against a position [s²]: α where the force is missing.

        Elsewhere the ratio of the two errors; infinite where z̈ = μ f − g is to hold exactly.
        """
        trust = self.com_error_m / self.force_error_m_s2 if self.force_error_m_s2 > 0 else np.inf
        return np.where(observed, trust, self.alpha_s2)
