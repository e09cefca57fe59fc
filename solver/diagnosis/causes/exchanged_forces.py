"""Forces under wrong names: of two plates, in part or whole, or along wrong axes."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from jaxtyping import Float

from solver.capture.resampling import bridge_gaps
from solver.diagnosis.causes.about import About, Entry, Named, Plates
from solver.diagnosis.causes.effect import Candidate, Eta, Signature
from solver.diagnosis.causes.gross_cause import GrossCause, points_ground, with_samples
from solver.diagnosis.causes.observed_trial import PlateScene, Scene, force_at, loaded_plates

# What turns recorded components into true ones. A plate whose vertical component is exchanged with another or
# negative throughout is turned upright on reading; the latter leaves both horizontal signs wrong, here "y".
TRUE_FROM_RECORDED = {
    "x": np.diag([-1.0, 1.0, 1.0]),
    "z": np.diag([1.0, 1.0, -1.0]),
    "xz": np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]),
    "y": np.diag([-1.0, 1.0, -1.0]),
}


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

    about = About(
        id="plate_swap",
        entry=Entry("`plate_a+plate_b`", "forces of two plates exchanged, centres of pressure not", ""),
        title="forces of {target} exchanged",
        sentence="The forces of two plates are exchanged ({target}).",
        remedy=(
            "Check which amplifier channel belongs to which plate, and the order of plates in the export."
        ),
        separate_by="a foot stamped on one plate, then on the other",
        branch="plate/channels",
        names=Named.PLATES,
        picture=Plates(),
    )

    def of_pair(self, a: PlateScene, b: PlateScene) -> tuple[PlateScene, PlateScene]:
        """Each with the other's forces."""
        return (
            with_samples(a, with_force_of(a, b), b.loads.carrying),
            with_samples(b, with_force_of(b, a), a.loads.carrying),
        )

    @classmethod
    def candidates(cls, scenes: Sequence[Scene]) -> list[Candidate]:
        """One for each two plates of a trial of which one is loaded."""
        targets = dict.fromkeys(
            f"{a.target}+{b.target}"
            for scene in scenes
            for a, b in combinations(scene.plates, 2)
            if a.loaded.any() or b.loaded.any()
        )
        return [cls(target) for target in targets]


@dataclass(frozen=True)
class PlateExchange(PairOfPlates):
    """Each plate's whole wrench was recorded as if the other had measured it: moved from middle to middle.

    How far the middles lie apart is known as well as each of them.
    """

    about = About(
        id="plate_exchange",
        entry=Entry(
            "`plate_a+plate_b`", "two plates in each other's place, forces and centres of pressure", ""
        ),
        title="{target} in each other's place",
        sentence=(
            "Each of two plates stands in the other's place in the files ({target}): forces and pressures."
        ),
        remedy=(
            "Check which cable belongs to which plate, and which corners belong to which plate in the "
            "laboratory's files."
        ),
        separate_by="a foot stamped on one plate, then on the other",
        branch="plate/channels",
        names=Named.PLATES,
        picture=Plates(),
    )

    def of_pair(self, a: PlateScene, b: PlateScene) -> tuple[PlateScene, PlateScene]:
        """Each with what the other recorded, at its own place."""
        return (
            with_samples(a, move_rigidly(b, a), b.loads.carrying),
            with_samples(b, move_rigidly(a, b), a.loads.carrying),
        )

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """Both plates corrected less as they are, and what middles farther apart change."""
        plain = super().signature(scene, eta)
        corrected = self.correct_plates(scene.plates)
        if plain is None or corrected is None:
            return None
        a, b = (p for p in corrected if p.target in self.targets)
        return self.beside_middles(plain, a.wrench_ground[:, :3] - b.wrench_ground[:, :3], a, b)

    @classmethod
    def candidates(cls, scenes: Sequence[Scene]) -> list[Candidate]:
        """One for each two plates of known places of which one is loaded, where files hold pressures.

        Without these an exchange of forces moves whole wrenches as well (`plate_swap`).
        """
        targets = dict.fromkeys(
            f"{a.target}+{b.target}"
            for scene in scenes
            for a, b in combinations(scene.plates, 2)
            if (a.loaded.any() or b.loaded.any())
            and all(p.loaded.any() or p.plate.corners_ground is not None for p in (a, b))
            and not (a.plate.point_ground is None and b.plate.point_ground is None)
        )
        return [cls(target) for target in targets]


@dataclass(frozen=True)
class AxisConvention(GrossCause):
    """A force component of all plates has the wrong sign, or two are exchanged; centres of pressure stay."""

    about = About(
        id="axis_convention",
        entry=Entry(
            "`x`, `y`, `z`, `xz`",
            "a force component has the wrong sign (`y`: x and z have), or x and z are exchanged",
            "",
        ),
        title="wrong axes of the forces: {target}",
        sentence=(
            "The axes of all plates' forces are not those of the markers ({target}); centres of pressure "
            "are right."
        ),
        remedy=(
            "Put signs and order of the force components right in the export, leave the centres of "
            "pressure as they are, and check on a push in a known direction."
        ),
        separate_by="a push against the floor in a known direction",
        branch="plate/channels",
        targets={
            "x": "force of every plate along x has the wrong sign",
            "y": "forces of every plate along x and z have the wrong sign",
            "z": "force of every plate along z has the wrong sign",
            "xz": "forces of every plate along x and z are exchanged",
        },
    )

    def correct_plates(self, plates: Sequence[PlateScene]) -> tuple[PlateScene, ...] | None:
        """Forces in the markers' axes at the recorded centres of pressure, with the recorded free moments."""
        if not any(plate.loaded.any() for plate in plates):
            return None
        change = TRUE_FROM_RECORDED[self.target] - np.eye(3)
        return tuple(
            with_samples(
                plate,
                plate.loads.wrench_ground
                + force_at(plate.loads.wrench_ground[:, :3] @ change.T, points_ground(plate)),
                plate.loads.carrying,
            )
            for plate in plates
        )

    @classmethod
    def candidates(cls, scenes: Sequence[Scene]) -> list[Candidate]:
        """Each convention, wrong for all plates alike."""
        return [cls(target) for target in TRUE_FROM_RECORDED] if loaded_plates(scenes) else []


def with_force_of(own: PlateScene, other: PlateScene) -> Float[np.ndarray, "samples 6"]:
    """A plate's samples if the other's columns hold its force; zero where those are unloaded."""
    loaded = other.loads.carrying
    points = _written_points(own, other)
    if points is None:
        return move_rigidly(other, own)
    wrench = force_at(other.loads.wrench_ground[:, :3], points)
    wrench[:, 4] += _free_moment(own, other)
    return np.where(loaded[:, None], wrench, 0.0)


def move_rigidly(plate: PlateScene, to: PlateScene) -> Float[np.ndarray, "samples 6"]:
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
    return bridge_gaps(columns, written)


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
