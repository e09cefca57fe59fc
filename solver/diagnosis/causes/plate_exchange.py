"""Plate exchange: the cables of two plates are exchanged, so that each one's force appears on the other."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from jaxtyping import Float

from solver.diagnosis.causes.about import About, Entry, Named
from solver.diagnosis.causes.effect import Candidate, Eta, Signature
from solver.diagnosis.causes.gross_cause import with_samples
from solver.diagnosis.causes.pictures import Plates
from solver.diagnosis.causes.plate_swap import PairOfPlates, moved_rigidly
from solver.diagnosis.causes.rearranged_plate import KNOWN_MIDDLE_M, UNKNOWN_MIDDLE_M
from solver.diagnosis.causes.scene import PlateScene, Scene
from solver.skeleton.forward import cross

ABOUT = About(
    id="plate_exchange",
    entry=Entry("`plate_a+plate_b`", "two plates in each other's place, forces and centres of pressure", ""),
    title="{target} in each other's place",
    sentence="Each of two plates stands in the other's place in the files ({target}): forces and pressures.",
    remedy=(
        "Check which cable belongs to which plate, and which corners belong to which plate in the "
        "laboratory's files."
    ),
    told_apart_by="a foot stamped on one plate, then on the other",
    branch="plate/channels",
    names=Named.PLATES,
    picture=Plates(),
)


@dataclass(frozen=True)
class PlateExchange(PairOfPlates):
    """Each plate's whole wrench was recorded as if the other had measured it: moved from middle to middle.

    How far the middles lie apart is known as well as each of them.
    """

    about = ABOUT

    def of_pair(self, a: PlateScene, b: PlateScene) -> tuple[PlateScene, PlateScene]:
        """Each with what the other recorded, at its own place."""
        return (
            with_samples(a, moved_rigidly(b, a), b.loads.carrying),
            with_samples(b, moved_rigidly(a, b), a.loads.carrying),
        )

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """Both plates corrected less as they are, and what middles farther apart change."""
        plain = super().signature(scene, eta)
        corrected = self.correct_plates(scene.plates)
        if plain is None or corrected is None:
            return None
        a, b = (p for p in corrected if p.target in self.targets)
        columns: Float[np.ndarray, "frames 6 2"] = np.zeros((scene.frames, 6, 2))
        for k, axis in enumerate(np.eye(3)[[0, 2]]):
            columns[:, 3:, k] = cross(axis, a.wrench_ground[:, :3] - b.wrench_ground[:, :3])
        known = all(p.plate.corners_ground is not None for p in (a, b))
        apart_m = np.sqrt(2) * (KNOWN_MIDDLE_M if known else UNKNOWN_MIDDLE_M)
        return replace(plain, columns=columns, prior_std=np.full(2, apart_m))


def candidates(scenes: Sequence[Scene]) -> list[Candidate]:
    """One for each two plates whose places are known and of which one is loaded, where files hold pressures.

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
    return [PlateExchange(target) for target in targets]
