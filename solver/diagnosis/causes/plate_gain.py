"""Plate gain: one force plate reads too much or too little."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.diagnosis.causes.about import About, Entry, Named, Size
from solver.diagnosis.causes.effect import Candidate, Estimate, Eta, Signature
from solver.diagnosis.causes.pictures import Plates
from solver.diagnosis.causes.readings import Reading
from solver.diagnosis.causes.scene import PlateScene, Scene, loaded_plates

PRIOR_STD = 0.05  # plates are off by 1 to 5 %
MOST = 0.2  # a plate that is off by more has the wrong units, or another fault
LEAST = 0.015  # within what plates of one laboratory scatter
MOST_LEFT = 0.5  # of the plate's force


ABOUT = About(
    id="plate_gain",
    entry=Entry("`plate_k`", "recorded = (1 + gain error) × true, force and moment", "`gain_error`"),
    title="wrong gain of {target}",
    sentence="{target} reads too much or too little by a constant factor.",
    remedy=("Put a known weight on the plate at several places and correct its calibration matrix."),
    told_apart_by=(
        "the plate empty, then with two known weights: an error that grows with the weight is a gain,"
        " the same error each time is a constant one"
    ),
    branch="plate/scale",
    names=Named.PLATES,
    odds_against=2.0,
    asked_up_to=20.0,
    sizes=(Size("gain_error", 0.03, 0.10, 0.20, "beyond, the units are wrong"),),
    readings=(Reading("gain_error", "it reads {amount} too {which}", "%", 1e2, which=("much", "little")),),
    picture=Plates(),
)


@dataclass(frozen=True)
class PlateGain(Candidate):
    """recorded = (1 + gain_error) × true, force and moment: true − recorded = −gain_error × true.

    True is what the motion demands of the plate, not what it recorded. What a sound balance leaves is what
    the fitted motion does not tell, and so has nothing to do with the demand; but it is part of the recorded
    force, so that a factor on that would shrink noise and seem to explain it.
    """

    about = ABOUT

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """Less what the motion demands of the plate."""
        for plate in scene.plates:
            if plate.target == self.target and plate.loaded.any():
                return Signature(-required_of(plate, scene)[:, :, None], np.array([PRIOR_STD]))
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
        return {"gain_error": Estimate(float(x[0]), float(np.sqrt(covariance[0, 0])))}

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """Beyond what sound plates scatter."""
        return LEAST < abs(estimates["gain_error"].value) < MOST


def required_of(plate: PlateScene, scene: Scene) -> Float[np.ndarray, "frames 6"]:
    """Wrench about the ground origin [N], [N·m]: the recorded one and its share of what all leave.

    The share is that of the vertical force. Where more than half of the plate's force is left, something else
    is wrong, and the recorded wrench is as good.
    """
    total = np.sum([p.loaded * p.wrench_ground[:, 1] for p in scene.plates], axis=0)
    own = plate.wrench_ground
    share = np.divide(own[:, 1], total, out=np.zeros(len(total)), where=plate.loaded & (total > 0))
    left = scene.required_ground - scene.measured_ground
    usual = np.linalg.norm(left[:, :3], axis=1) < MOST_LEFT * np.linalg.norm(own[:, :3], axis=1)
    return own + np.where(usual, np.clip(share, 0.0, 1.0), 0.0)[:, None] * left


def candidates(scenes: Sequence[Scene]) -> list[Candidate]:
    """One for each plate."""
    return [PlateGain(target) for target in loaded_plates(scenes)]
