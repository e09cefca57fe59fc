"""Plate position: one plate lies elsewhere than the laboratory's files say."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.diagnosis.causes.about import About, Entry, Named, Size
from solver.diagnosis.causes.effect import Candidate, Estimate, Eta, Signature
from solver.diagnosis.causes.pictures import Plates
from solver.diagnosis.causes.readings import along
from solver.diagnosis.causes.scene import Scene, loaded_plates
from solver.skeleton.forward import cross

PRIOR_STD_M = 0.01  # a calibration wand misplaced, a corner clicked beside the corner: 1 to 20 mm
GROSS_STD_M = 0.15  # another plate's corners, a wrong origin: a plate's side and more
GROSS_ODDS = 3.5  # [nats] against that: 1 in 30
LEAST_M = 0.005  # half of what spends the limit on residual moments
SHIFTS = ("shift_x_m", "shift_z_m")


ABOUT = About(
    id="plate_position",
    entry=Entry("`plate_k`", "recorded − true centre of pressure", "`shift_x_m`, `shift_z_m`"),
    title="wrong position of {target}",
    sentence="{target} is not exactly where the files place it.",
    remedy=(
        "Measure the plate's corners again, with a pointer or markers on them, after each camera calibration."
    ),
    told_apart_by="a pointed rod pressed on the plate at several known places",
    branch="plate/geometry",
    names=Named.PLATES,
    usual_std=0.001,
    asked_up_to=60.0,
    sizes=(
        Size("shift_x_m", 0.008, 0.03, 0.3, "half a plate's side at most; beyond, its geometry is wrong"),
    ),
    readings=along(
        "shift_{}_m", "the files place it {{amount}} too far towards {{which}}", "mm", 1e3, axes="xz"
    ),
    picture=Plates(shift="shift_{}_m"),
)


@dataclass(frozen=True)
class PlatePosition(Candidate):
    """recorded − true centre of pressure = shift, in the floor; exact at any size.

    Force and free moment stay, so true − recorded moment = −shift × force.
    """

    prior_std_m: float = PRIOR_STD_M

    about = ABOUT

    @property
    def place_odds(self) -> float:
        """Plates in another place altogether are rarer."""
        return 0.0 if self.prior_std_m == PRIOR_STD_M else GROSS_ODDS

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """Moments alone: the plate's force times the shift along x and z."""
        for plate in scene.plates:
            if plate.target == self.target and plate.loaded.any():
                columns = np.zeros((scene.frames, 6, 2))
                for k, axis in enumerate(np.eye(3)[[0, 2]]):
                    columns[:, 3:, k] = -cross(axis, plate.wrench_ground[:, :3])
                return Signature(columns, np.full(2, self.prior_std_m))
        return None

    def estimates(
        self,
        scenes: Sequence[Scene],
        eta: Eta,
        eta_std: Eta,
        x: Float[np.ndarray, "2"],
        covariance: Float[np.ndarray, "2 2"],
    ) -> dict[str, Estimate]:
        """shift_x_m, shift_z_m."""
        std = np.sqrt(np.diag(covariance))
        return {name: Estimate(float(x[k]), float(std[k])) for k, name in enumerate(SHIFTS)}

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """Beyond what calibrations of one laboratory scatter."""
        return float(np.linalg.norm([estimates[name].value for name in SHIFTS])) > LEAST_M


def candidates(scenes: Sequence[Scene]) -> list[Candidate]:
    """For each plate a little beside its place, and far from it."""
    return [
        PlatePosition(target, std) for target in loaded_plates(scenes) for std in (PRIOR_STD_M, GROSS_STD_M)
    ]
