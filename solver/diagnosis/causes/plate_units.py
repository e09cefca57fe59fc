"""Plate units: one plate's forces and moments are in other units, or its range is set wrong."""

import math
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

ERRORS_LAST_S = 0.06  # of what the model gets wrong
MOST_ROWS = 600.0
FACTORS = (1 / 9.80665, 1 / 4.448222, 0.25, 0.5, 2.0, 4.0, 4.448222, 9.80665)
# recorded over true: kilograms and pounds for newtons, and the other way; amplifiers' ranges

ABOUT = About(
    id="plate_units",
    entry=Entry(
        "`plate_k`",
        "recorded = factor × true: kilograms, pounds, a range of the amplifier",
        "`factor`",
    ),
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
    rows: float = 0.0  # independent means of force and moment that the plate gave while it was loaded

    about = ABOUT

    @property
    def seen_elsewhere(self) -> float:
        """What a factor above 1 gains by nothing but smaller numbers.

        Halved forces leave smaller rests, whatever is wrong. With recorded = factor × true the density of
        what was recorded is that of what is true, divided by the factor, in each independent mean. A factor
        below 1 would be rewarded likewise; where it is not right it makes rests larger, and needs no reward.
        """
        return -self.rows * max(0.0, math.log(self.factor))

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
    return [
        PlateUnits(target, factor, _independent_rows(scenes, target))
        for target in loaded_plates(scenes)
        for factor in FACTORS
    ]


def _independent_rows(scenes: Sequence[Scene], target: str) -> float:
    """Three forces and three moments in each stretch as long as errors last, as far as a balance has rows."""
    loaded_s = sum(p.loaded.sum() / s.rate for s in scenes for p in s.plates if p.target == target)
    return min(6.0 * float(loaded_s) / ERRORS_LAST_S, MOST_ROWS)
