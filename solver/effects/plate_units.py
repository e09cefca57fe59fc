"""Plate units: one plate's forces and moments are in other units, or its range is set wrong."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.effects.about import About, Named
from solver.effects.effect import Candidate, Estimate
from solver.effects.pictures import Plates
from solver.effects.readings import Reading
from solver.effects.rearranged_plate import RearrangedPlate
from solver.effects.scene import Scene, loaded_plates

FACTORS = (1 / 9.80665, 1 / 4.448222, 0.25, 0.5, 2.0, 4.0, 4.448222, 9.80665)
# recorded over true: kilograms and pounds for newtons, and the other way; amplifiers' ranges

ABOUT = About(
    id="plate_units",
    title="wrong units of {target}",
    sentence="{target} reads a multiple of the true force: other units, or a wrong range of its amplifier.",
    remedy=(
        "Check the units of this plate's channels in the export (N, kg, lb) and the range that its amplifier "
        "is set to; put a known weight on it."
    ),
    told_apart_by="a known weight on the plate",
    branch="plate/scale",
    names=Named.PLATES,
    odds_against=2.0,
    readings=(Reading("factor", "it reads {amount} of the true force", "times"),),
    picture=Plates(),
)


@dataclass(frozen=True)
class PlateUnits(RearrangedPlate):
    """recorded = factor × true, force and moment."""

    factor: float = 0.5

    about = ABOUT

    @property
    def R_true_recorded(self) -> Float[np.ndarray, "3 3"]:
        """None."""
        return np.eye(3)

    @property
    def scale(self) -> float:
        """Over what was recorded."""
        return 1 / self.factor

    def plate_factors(self) -> dict[str, float]:
        """A weight on the plate is read so many times."""
        return {self.target: self.factor}

    @property
    def as_found(self) -> dict[str, Estimate]:
        """The factor."""
        return {"factor": Estimate(self.factor, 0.0)}


def candidates(scenes: Sequence[Scene]) -> list[Candidate]:
    """Each factor of each plate."""
    return [PlateUnits(target, factor) for target in loaded_plates(scenes) for factor in FACTORS]
