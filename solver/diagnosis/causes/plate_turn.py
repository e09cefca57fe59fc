"""Plate turn: the files have one plate turned by a quarter or a half about the vertical."""

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

TURNS_DEG = (90, 180, -90)

ABOUT = About(
    id="plate_turn",
    entry=Entry(
        "`plate_k`",
        (
            "recorded force, moment and pressure turned by a quarter or a half about the vertical through "
            "the plate's middle"
        ),
        "`turn_deg`",
    ),
    title="{target} turned by 90° or 180°",
    sentence="In the files the axes of {target} are turned by 90° or 180° about the vertical.",
    remedy=(
        "Compare the order of the plate's corners, and its x and y, with how it lies in the floor, and put "
        "them right in the laboratory's files."
    ),
    told_apart_by="a push against the plate in a known direction, at a known place off its middle",
    branch="plate/geometry",
    names=Named.PLATES,
    odds_against=2.0,
    readings=(Reading("turn_deg", "recorded turned by {signed} about the vertical", "°"),),
    picture=Plates(),
)


@dataclass(frozen=True)
class PlateTurn(RearrangedPlate):
    """recorded = R_y(turn) true, force and moment about the plate's middle, pressures with them."""

    turn_deg: int = 90

    about = ABOUT

    @property
    def R_true_recorded(self) -> Float[np.ndarray, "3 3"]:
        """Turned back."""
        c, s = np.round(np.cos(np.radians(self.turn_deg))), np.round(np.sin(np.radians(self.turn_deg)))
        return np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])

    @property
    def as_found(self) -> dict[str, Estimate]:
        """turn_deg."""
        return {"turn_deg": Estimate(float(self.turn_deg), 0.0)}


def candidates(scenes: Sequence[Scene]) -> list[Candidate]:
    """Each turn of each plate."""
    return [PlateTurn(target, turn) for target in loaded_plates(scenes) for turn in TURNS_DEG]
