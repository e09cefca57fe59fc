"""Axis convention: a component of the force has the wrong sign, or two are exchanged."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.effects.changed_force import wrench_change
from solver.effects.effect import Candidate, Estimate, Eta, Signature
from solver.effects.scene import Scene

# What turns recorded components into true ones. A plate whose vertical component is exchanged with another or
# negative throughout is turned upright on reading; the latter leaves both horizontal signs wrong, here "y".
TRUE_FROM_RECORDED = {
    "x": np.diag([-1.0, 1.0, 1.0]),
    "z": np.diag([1.0, 1.0, -1.0]),
    "xz": np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]),
    "y": np.diag([-1.0, 1.0, -1.0]),
}


@dataclass(frozen=True)
class AxisConvention(Candidate):
    """A force component of all plates has the wrong sign, or two are exchanged; centres of pressure stay."""

    id = "axis_convention"
    sentence = (
        "The axes of all plates' forces are not those of the markers ({target}); centres of pressure are "
        "right."
    )
    remedy = (
        "Put signs and order of the force components right in the export, leave the centres of pressure as "
        "they are, and check on a push in a known direction."
    )
    rivals_told_apart_by = "a push against the floor in a known direction"

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """The force put right less the recorded one, at the recorded centre of pressure."""
        if not any(plate.loaded.any() for plate in scene.plates):
            return None
        change = TRUE_FROM_RECORDED[self.target] - np.eye(3)
        fixed = np.zeros((scene.frames, 6))
        for plate in scene.plates:
            fixed += wrench_change(plate, plate.loads.wrench_ground[:, :3] @ change.T)
        return Signature(np.zeros((scene.frames, 6, 0)), np.zeros(0), fixed)

    def estimates(
        self,
        scenes: Sequence[Scene],
        eta: Eta,
        eta_std: Eta,
        x: Float[np.ndarray, "0"],
        covariance: Float[np.ndarray, "0 0"],
    ) -> dict[str, Estimate]:
        """Nothing to estimate."""
        return {}

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """Always."""
        return True


def candidates(scenes: Sequence[Scene]) -> list[Candidate]:
    """Each convention, wrong for all plates alike."""
    loaded = any(plate.loaded.any() for scene in scenes for plate in scene.plates)
    return [AxisConvention(target) for target in TRUE_FROM_RECORDED] if loaded else []
