"""Plate clock: one plate is late or early, the others are not."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from solver.diagnosis.causes.about import About, Entry, Named, Size
from solver.diagnosis.causes.clock_offset import ClockOffset
from solver.diagnosis.causes.effect import Candidate, Estimate, Eta, Signature
from solver.diagnosis.causes.pictures import Plates
from solver.diagnosis.causes.readings import Reading
from solver.diagnosis.causes.scene import PlateScene, Scene

LEAST_S = 0.004  # amplifiers of one kind delay alike

ABOUT = About(
    id="plate_clock",
    entry=Entry("`plate_k`", "recorded force(t) = true force(t − offset), of one plate alone", "`offset_s`"),
    title="forces of {target} shifted in time against the other plates",
    sentence="The forces of {target} alone come too late or too early.",
    remedy=(
        "Compare this plate's amplifier and converter with the others': a filter that runs one way only, a "
        "lost sample, another trigger."
    ),
    told_apart_by="a foot stamped on each plate in turn",
    branch="time/clock of one plate",
    names=Named.PLATES,
    odds_against=4.0,
    sizes=(Size("offset_s", 0.01, 0.05, 0.3, "filters and triggers of one amplifier"),),
    readings=(
        Reading("offset_s", "its forces come {amount} {which}", "ms", 1e3, which=("too late", "too early")),
    ),
    picture=Plates(),
)


@dataclass(frozen=True)
class PlateClock(ClockOffset):
    """recorded(t) = true(t − offset_s) for one plate: true(t) = recorded(t + offset_s)."""

    about = ABOUT

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """The plate shifted less unshifted; what was recorded at no such time stays as it is."""
        plate = self._plate(scene)
        if plate is None:
            return None
        shifted = plate.at_times(plate.loads.wrench_ground, plate.times + eta[0])
        unrecorded = self.unrecorded(scene, eta)
        shifted[unrecorded] = plate.wrench_ground[unrecorded]
        fixed = np.nan_to_num(shifted) - plate.wrench_ground
        return Signature(np.zeros((scene.frames, 6, 0)), np.zeros(0), fixed)

    def unrecorded(self, scene: Scene, eta: Eta) -> Bool[np.ndarray, " frames"]:
        """Those that the right clock puts outside the recording."""
        plate = self._plate(scene)
        if plate is None:
            return np.zeros(scene.frames, dtype=bool)
        return ~plate.covers(plate.times + eta[0])

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """Beyond what amplifiers of one kind differ by."""
        return abs(estimates["offset_s"].value) > LEAST_S

    def _plate(self, scene: Scene) -> PlateScene | None:
        return next((p for p in scene.plates if p.target == self.target and p.loaded.any()), None)


def candidates(scenes: Sequence[Scene]) -> list[Candidate]:
    """Each plate, where several bear a load in some trial."""
    several = [[p.target for p in scene.plates if p.loaded.any()] for scene in scenes]
    return [PlateClock(target) for target in dict.fromkeys(t for own in several if len(own) > 1 for t in own)]
