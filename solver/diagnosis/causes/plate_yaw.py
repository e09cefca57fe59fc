"""Plate yaw: one plate's axes are turned about the vertical against what the files say."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.diagnosis.causes.about import About, Entry, Named
from solver.diagnosis.causes.effect import Candidate, Estimate, Eta, Signature
from solver.diagnosis.causes.pictures import Plates
from solver.diagnosis.causes.readings import Reading
from solver.diagnosis.causes.scene import Scene, loaded_plates
from solver.skeleton.forward import cross

PRIOR_STD_RAD = np.radians(
    4.0
)  # corners clicked a centimetre beside the corner, or taken from an old drawing
LEAST_DEG = 1.0
UP = np.array([0.0, 1.0, 0.0])


ABOUT = About(
    id="plate_yaw",
    entry=Entry(
        "`plate_k`",
        "recorded force and centre of pressure turned about the vertical through the plate's centre",
        "`yaw_deg`",
    ),
    title="{target} turned about the vertical",
    sentence="{target} is turned about the vertical relative to the axes in the files.",
    remedy="Measure the plate's corners again and check their order in the files.",
    told_apart_by="a pointed rod pressed on the plate near its corners",
    branch="plate/geometry",
    names=Named.PLATES,
    odds_against=-2.0,
    asked_up_to=15.0,
    readings=(
        Reading(
            "yaw_deg",
            "what was recorded is turned by {amount} {which} about the plate's centre",
            "°",
            which=(
                "counter-clockwise, seen from above: turn its forces and centres of pressure back clockwise",
                "clockwise, seen from above: turn its forces and centres of pressure back counter-clockwise",
            ),
        ),
    ),
    picture=Plates(yaw="yaw_deg"),
)


@dataclass(frozen=True)
class PlateYaw(Candidate):
    """recorded force and centre of pressure = R_y(yaw) × true about the plate's centre, right hand about +y.

    Linear in x = sin(yaw): force and moment about the centre turn back by −x (y × ·). What is left out,
    (1 − cos(yaw)) of the horizontal parts, is a fortieth of the effect at 3 degrees.
    """

    about = ABOUT

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """Horizontal force and horizontal moment about the centre, each turned by a right angle."""
        for plate in scene.plates:
            if plate.target == self.target and plate.loaded.any():
                force, moment = plate.wrench_ground[:, :3], plate.wrench_ground[:, 3:]
                force_back = -cross(UP, force)
                about_centre_back = -cross(UP, moment - cross(plate.centre_ground, force))
                moment_back = about_centre_back + cross(plate.centre_ground, force_back)
                column = np.concatenate([force_back, moment_back], axis=1)
                return Signature(column[:, :, None], np.array([PRIOR_STD_RAD]))
        return None

    def estimates(
        self,
        scenes: Sequence[Scene],
        eta: Eta,
        eta_std: Eta,
        x: Float[np.ndarray, "1"],
        covariance: Float[np.ndarray, "1 1"],
    ) -> dict[str, Estimate]:
        """yaw_deg."""
        sine = float(np.clip(x[0], -0.99, 0.99))
        std = float(np.sqrt(covariance[0, 0])) / np.sqrt(1 - sine**2)
        return {"yaw_deg": Estimate(float(np.degrees(np.arcsin(sine))), float(np.degrees(std)))}

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """Beyond what careful calibrations scatter."""
        return abs(estimates["yaw_deg"].value) > LEAST_DEG


def candidates(scenes: Sequence[Scene]) -> list[Candidate]:
    """One for each plate."""
    return [PlateYaw(target) for target in loaded_plates(scenes)]
