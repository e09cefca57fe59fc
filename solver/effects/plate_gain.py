"""Plate gain: one force plate reads too much or too little."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.effects.effect import Candidate, Estimate, Eta, Signature
from solver.effects.scene import Scene

PRIOR_STD = 0.05  # plates are off by 1 to 5 %
MOST = 0.2  # a plate that is off by more has the wrong units, or another fault
LEAST = 0.015  # within what plates of one laboratory scatter


@dataclass(frozen=True)
class PlateGain(Candidate):
    """recorded = (1 + gain_error) × true, force and moment.

    Exact at any size: true − recorded = x × recorded with x = 1/(1 + gain_error) − 1.
    """

    id = "plate_gain"
    sentence = "{target} reads a constant factor too much or too little."
    remedy = "Put a known weight on the plate at several places and correct its calibration matrix."
    rivals_told_apart_by = "a known weight on each plate"

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """The plate's own wrench."""
        for plate in scene.plates:
            if plate.target == self.target and plate.loaded.any():
                return Signature(plate.wrench_ground[:, :, None], np.array([PRIOR_STD]))
        return None

    def estimates(
        self,
        scenes: Sequence[Scene],
        eta: Eta,
        eta_std: Eta,
        x: Float[np.ndarray, "1"],
        covariance: Float[np.ndarray, "1 1"],
    ) -> dict[str, Estimate]:
        """gain_error, dimensionless."""
        gain_error = 1 / (1 + float(x[0])) - 1
        return {"gain_error": Estimate(gain_error, float(np.sqrt(covariance[0, 0])) * (1 + gain_error) ** 2)}

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """Beyond what sound plates scatter."""
        return LEAST < abs(estimates["gain_error"].value) < MOST


def candidates(scenes: Sequence[Scene]) -> list[Candidate]:
    """One for each plate."""
    targets = dict.fromkeys(plate.target for scene in scenes for plate in scene.plates if plate.loaded.any())
    return [PlateGain(target) for target in targets]
