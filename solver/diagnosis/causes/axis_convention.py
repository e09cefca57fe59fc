"""Axis convention: a component of the force has the wrong sign, or two are exchanged."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from solver.diagnosis.causes.about import About, Entry
from solver.diagnosis.causes.changed_force import points_ground
from solver.diagnosis.causes.effect import Candidate
from solver.diagnosis.causes.gross_cause import GrossCause, with_samples
from solver.diagnosis.causes.scene import PlateScene, Scene, force_at

# What turns recorded components into true ones. A plate whose vertical component is exchanged with another or
# negative throughout is turned upright on reading; the latter leaves both horizontal signs wrong, here "y".
TRUE_FROM_RECORDED = {
    "x": np.diag([-1.0, 1.0, 1.0]),
    "z": np.diag([1.0, 1.0, -1.0]),
    "xz": np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]),
    "y": np.diag([-1.0, 1.0, -1.0]),
}


ABOUT = About(
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
    told_apart_by="a push against the floor in a known direction",
    branch="plate/channels",
    targets={
        "x": "force of every plate along x has the wrong sign",
        "y": "forces of every plate along x and z have the wrong sign",
        "z": "force of every plate along z has the wrong sign",
        "xz": "forces of every plate along x and z are exchanged",
    },
)


@dataclass(frozen=True)
class AxisConvention(GrossCause):
    """A force component of all plates has the wrong sign, or two are exchanged; centres of pressure stay."""

    about = ABOUT

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


def candidates(scenes: Sequence[Scene]) -> list[Candidate]:
    """Each convention, wrong for all plates alike."""
    loaded = any(plate.loaded.any() for scene in scenes for plate in scene.plates)
    return [AxisConvention(target) for target in TRUE_FROM_RECORDED] if loaded else []
