"""Object on a plate: something stands on it all through a trial, also while the foot is away."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.common.gravity import GRAVITY
from solver.common.plate_figures import HALF_SIDE_M
from solver.diagnosis.causes.about import About, AtFault, Entry, Named, Size
from solver.diagnosis.causes.carried_mass import LEAST_STDS
from solver.diagnosis.causes.effect import Candidate, Estimate, Eta, InTrials, Signature, all_and_each
from solver.diagnosis.causes.pictures import Plates
from solver.diagnosis.causes.readings import Reading, along
from solver.diagnosis.causes.scene import PlateScene, Scene, force_at, loaded_plates

PRIOR_KG = 6.0  # a chair, a box, a rucksack that was put down
MOST_ASIDE_M = 0.8  # farther off it stands on another plate, or nowhere
LEAST_KG = 1.0  # a shoe
ASIDE = ("aside_x_m", "aside_z_m")

ABOUT = About(
    id="object_on_plate",
    entry=Entry(
        "`plate_k`",
        "something stands on the plate all the time, also while the foot is away",
        "`mass_kg`, `aside_x_m`, `aside_z_m` (from the plate's middle)",
    ),
    title="an object on {target}",
    sentence="Something stands on {target} all the time and is measured with the person.",
    remedy="Take it off the plate and record again, or weigh it and take its weight off this plate's forces.",
    told_apart_by="a second of recording with nobody on the plate, with and without the object",
    branch="ground/object on a plate",
    names=Named.PLATES,
    at_fault=AtFault.MOVEMENT,
    odds_against=4.0,
    sizes=(Size("mass_kg", 5.0, 20.0, 60.0, "a chair, a box; beyond, another person"),),
    readings=(
        Reading("mass_kg", "it weighs {amount}", "kg"),
        *along("aside_{}_m", "{{amount}} from the plate's middle towards {{which}}", "mm", 1e3, axes="xz"),
    ),
    picture=Plates(),
)


@dataclass(frozen=True)
class ObjectOnPlate(InTrials):
    """recorded = true + W upward at a point of the plate, on every sample that was recorded as loaded.

    Linear in W, W (p_x − c_x) and W (p_z − c_z), with c the plate's middle. A plate that was seen empty, with
    less on it than a contact's threshold, bears no more than that.
    """

    about = ABOUT

    most_N: float = math.inf  # what it may weigh

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """Less a newton upwards at the middle, and its moments a metre beside it along x and z."""
        plate = self._plate(scene)
        if plate is None or self.trial not in (None, scene.name):
            return None
        share = np.nan_to_num(plate.at_frames(plate.loads.carrying.astype(float)))
        up = np.array([0.0, 1.0, 0.0])
        middle = force_at(up, plate.centre_ground)
        aside = [force_at(up, plate.centre_ground + axis) - middle for axis in np.eye(3)[[0, 2]]]
        newton = np.stack([middle, *aside], axis=1)
        weight_N = PRIOR_KG * GRAVITY
        return Signature(-share[:, None, None] * newton, weight_N * np.array([1.0, HALF_SIDE_M, HALF_SIDE_M]))

    def estimates(
        self,
        scenes: Sequence[Scene],
        eta: Eta,
        eta_std: Eta,
        x: Float[np.ndarray, "3"],
        covariance: Float[np.ndarray, "3 3"],
    ) -> dict[str, Estimate]:
        """mass_kg, and how far from the plate's middle it stands by division."""
        found = {"mass_kg": Estimate(float(x[0]) / GRAVITY, float(np.sqrt(covariance[0, 0])) / GRAVITY)}
        divisor = np.copysign(max(abs(float(x[0])), 1e-6), float(x[0]))
        for i, name in enumerate(ASIDE, start=1):
            away = float(x[i]) / divisor
            gradient = np.array([-away, 1.0]) / divisor
            both = covariance[np.ix_([0, i], [0, i])]
            found[name] = Estimate(away, float(np.sqrt(gradient @ both @ gradient)))
        return found

    def is_possible(self, estimates: dict[str, Estimate]) -> bool:
        """It weighs something, and stands on or near the plate."""
        aside_m = math.hypot(*(estimates[name].value for name in ASIDE))
        return 0 < GRAVITY * estimates["mass_kg"].value < self.most_N and aside_m < MOST_ASIDE_M

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """Heavier than a shoe, and a weight, not just a moment."""
        mass = estimates["mass_kg"]
        return mass.value > max(LEAST_KG, LEAST_STDS * mass.std)

    def _plate(self, scene: Scene) -> PlateScene | None:
        return next((p for p in scene.plates if p.target == self.target and p.loads.carrying.any()), None)


def candidates(scenes: Sequence[Scene]) -> list[Candidate]:
    """On each plate: in all trials, and in each alone where there are several."""
    found: list[Candidate] = []
    for trial in all_and_each(scenes):
        for target in loaded_plates(scenes):
            own = [p for s in scenes for p in s.plates if p.target == target and trial in (None, s.name)]
            limits = [p.conditioning.threshold_N for p in own if p.seen_empty]
            found.append(ObjectOnPlate(target, trial, min(limits, default=math.inf)))
    return found
