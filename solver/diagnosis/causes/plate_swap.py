"""Plate swap: the forces of two plates stand in each other's columns."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from jaxtyping import Float

from solver.capture.resampling import bridged
from solver.diagnosis.causes.about import About, Entry, Named
from solver.diagnosis.causes.changed_force import points_ground
from solver.diagnosis.causes.effect import Candidate
from solver.diagnosis.causes.gross_cause import GrossCause, with_samples
from solver.diagnosis.causes.pictures import Plates
from solver.diagnosis.causes.scene import PlateScene, Scene, force_at

ABOUT = About(
    id="plate_swap",
    entry=Entry("`plate_a+plate_b`", "forces of two plates exchanged, centres of pressure not", ""),
    title="forces of {target} exchanged",
    sentence="The forces of two plates are exchanged ({target}).",
    remedy=("Check which amplifier channel belongs to which plate, and the order of plates in the export."),
    told_apart_by="a foot stamped on one plate, then on the other",
    branch="plate/channels",
    names=Named.PLATES,
    picture=Plates(),
)


@dataclass(frozen=True)
class PairOfPlates(GrossCause):
    """Something that two plates have of each other; both hang on one clock."""

    @property
    def targets(self) -> tuple[str, str]:
        """Of the two."""
        one, other = self.target.split("+")
        return one, other

    def target_corrected(self, target: str) -> str:
        """The other of the two plates."""
        one, other = self.targets
        return {one: other, other: one}.get(target, target)

    @abstractmethod
    def of_pair(self, a: PlateScene, b: PlateScene) -> tuple[PlateScene, PlateScene]:
        """Both as they should have been recorded."""

    def correct_plates(self, plates: Sequence[PlateScene]) -> tuple[PlateScene, ...] | None:
        """All plates with these two corrected; None unless one clock drives both."""
        pair = [plate for plate in plates if plate.target in self.targets]
        if len(pair) != 2 or not any(plate.loaded.any() for plate in pair):
            return None
        a, b = pair
        if (a.plate.samples, a.plate.rate, a.plate.start_time) != (
            b.plate.samples,
            b.plate.rate,
            b.plate.start_time,
        ):
            return None
        own = {plate.target: plate for plate in self.of_pair(a, b)}
        return tuple(own.get(plate.target, plate) for plate in plates)


@dataclass(frozen=True)
class PlateSwap(PairOfPlates):
    """The forces of two plates are exchanged, their centres of pressure stay.

    Where the files hold no centres of pressure, those follow the forces: each plate's wrench then moves from
    the other's centre to its own.
    """

    about = ABOUT

    def of_pair(self, a: PlateScene, b: PlateScene) -> tuple[PlateScene, PlateScene]:
        """Each with the other's forces."""
        return (
            with_samples(a, with_force_of(a, b), b.loads.carrying),
            with_samples(b, with_force_of(b, a), a.loads.carrying),
        )


def candidates(scenes: Sequence[Scene]) -> list[Candidate]:
    """One for each two plates of a trial of which one is loaded."""
    targets = dict.fromkeys(
        f"{a.target}+{b.target}"
        for scene in scenes
        for a, b in combinations(scene.plates, 2)
        if a.loaded.any() or b.loaded.any()
    )
    return [PlateSwap(target) for target in targets]


def with_force_of(own: PlateScene, other: PlateScene) -> Float[np.ndarray, "samples 6"]:
    """A plate's samples if the other's columns hold its force; zero where those are unloaded."""
    loaded = other.loads.carrying
    points = _written_points(own, other)
    if points is None:
        return moved_rigidly(other, own)
    wrench = force_at(other.loads.wrench_ground[:, :3], points)
    wrench[:, 4] += _free_moment(own, other)
    return np.where(loaded[:, None], wrench, 0.0)


def moved_rigidly(plate: PlateScene, to: PlateScene) -> Float[np.ndarray, "samples 6"]:
    """A plate's samples, moved as a whole from its middle to another's; zero where they are unloaded."""
    force = plate.loads.wrench_ground[:, :3]
    moved = force_at(force, np.broadcast_to(to.centre_ground - plate.centre_ground, force.shape))
    moved[:, 3:] += plate.loads.wrench_ground[:, 3:]
    return np.where(plate.loads.carrying[:, None], moved, 0.0)


def _written_points(own: PlateScene, other: PlateScene) -> Float[np.ndarray, "samples 3"] | None:
    """The plate's own centres of pressure while the other's columns are loaded; None if the file has none."""
    columns = own.plate.point_ground
    if columns is None:
        return None
    written = other.loads.carrying & np.isfinite(columns).all(axis=1)
    if not written.any():
        return None
    return bridged(columns, written)


def _free_moment(own: PlateScene, other: PlateScene) -> Float[np.ndarray, " samples"]:
    """Of the one plate [N·m]: beside its centres of pressure if they stand there, else with its force."""
    here, there = _recorded_free_moment(own), _recorded_free_moment(other)
    apart = other.loads.carrying & ~own.loads.carrying
    stays = (here[apart] ** 2).sum() > (there[apart] ** 2).sum()
    return here if stays else there


def _recorded_free_moment(plate: PlateScene) -> Float[np.ndarray, " samples"]:
    """The vertical moment about the centre of pressure; about the origin where there is no force."""
    return (
        plate.loads.raw_ground[:, 4] - force_at(plate.loads.wrench_ground[:, :3], points_ground(plate))[:, 4]
    )
