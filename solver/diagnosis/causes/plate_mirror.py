"""Plate mirror: one horizontal axis of a plate points the other way in the files."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.diagnosis.causes.about import About, Entry, Named
from solver.diagnosis.causes.effect import Candidate, Estimate
from solver.diagnosis.causes.pictures import Plates
from solver.diagnosis.causes.readings import Reading
from solver.diagnosis.causes.rearranged_plate import RearrangedPlate
from solver.diagnosis.causes.scene import Scene, loaded_plates

MIRRORS = {
    0: np.diag([-1.0, 1.0, 1.0]),
    90: np.diag([1.0, 1.0, -1.0]),
    45: np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]),
    -45: np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]),
}  # by the direction of the axis that is reversed, degrees from x towards z

ABOUT = About(
    id="plate_mirror",
    entry=Entry(
        "`plate_k`",
        "one horizontal axis of force and pressure reversed about the plate's middle",
        "`mirrored_axis_deg` (from x towards z)",
    ),
    title="{target} mirrored",
    sentence="One horizontal axis of {target} points the other way in the files, for force and pressure.",
    remedy=(
        "Compare the order in which the files list the plate's corners with how it lies in the floor: they "
        "go round the wrong way, or one axis has the wrong sign."
    ),
    told_apart_by="a push against the plate in a known direction, at a known place off its middle",
    branch="plate/geometry",
    names=Named.PLATES,
    odds_against=2.0,
    readings=(
        Reading("mirrored_axis_deg", "the axis that is reversed lies at {signed} from x towards z", "°"),
    ),
    picture=Plates(),
)


@dataclass(frozen=True)
class PlateMirror(RearrangedPlate):
    """recorded = M true about the plate's middle, M a reflection; moments go by −M, being no vectors."""

    axis_deg: int = 0

    about = ABOUT

    @property
    def R_true_recorded(self) -> Float[np.ndarray, "3 3"]:
        """A reflection undoes itself."""
        return MIRRORS[self.axis_deg]

    @property
    def as_found(self) -> dict[str, Estimate]:
        """mirrored_axis_deg."""
        return {"mirrored_axis_deg": Estimate(float(self.axis_deg), 0.0)}


def candidates(scenes: Sequence[Scene]) -> list[Candidate]:
    """Each mirror of each plate."""
    return [PlateMirror(target, axis) for target in loaded_plates(scenes) for axis in MIRRORS]
