"""Carried mass: something heavy is fixed to a segment, and the model does not know."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.diagnosis.causes.about import About, AtFault, Entry, Named, Size, Weight
from solver.diagnosis.causes.effect import Candidate, Estimate, Eta, InTrials, Signature, all_and_each
from solver.diagnosis.causes.limbs import BETWEEN_OTHERS_ODDS, inner_arm_segments
from solver.diagnosis.causes.pictures import Ball
from solver.diagnosis.causes.readings import NOT_TOLD, ON_SEGMENT, Place, Reading
from solver.diagnosis.causes.required_by_inertia import required_by_changes
from solver.diagnosis.causes.scene import Scene

LIGHTEST_SHARE = 0.004  # of body mass: what lighter ones carry (toes), their neighbours carry as well
PRIOR_KG = 4.0  # a rucksack, a measuring unit, ankle weights
REACH_M = 0.12  # from the segment's centre of mass to the load's
SPREAD_M = 0.12  # of the load itself, and of its place, as radius of gyration
LEAST_KG = 0.5  # shoes and clothes
LEAST_STDS = 3.0  # else only moments are seen, which a wrong centre of mass, or a plate's place, has as well
FARTHEST_M = 0.8  # from the segment's origin: whatever is carried, lies on the body
MOMENTS = ((0, 3), (1, 3), (2, 3), (0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))  # entries of J


ABOUT = About(
    id="carried_mass",
    entry=Entry(
        "body",
        "a load that the model lacks, its centre in the body's frame",
        "`mass_kg`, `offset_x_m`, `offset_y_m`, `offset_z_m`",
    ),
    title="a load that is not in the model: {target}",
    sentence="A load that is not in the model is carried on {target}.",
    remedy=(
        "Weigh the load and note where it was fixed. Accept the cause for these trials or make the "
        "load part of the model, not both."
    ),
    told_apart_by="the person on a scale, with and without the load",
    branch="on the person/load",
    names=Named.BODIES,
    at_fault=AtFault.MODEL,
    weight=Weight.MASS,
    odds_against=6.0,
    sizes=(Size("mass_kg", 3.0, 20.0, 50.0, "on the trunk; 5 kg in a hand, 3 kg on a foot at most"),),
    readings=(
        Reading("mass_kg", "it weighs {amount}", "kg"),
        Place(
            "offset_{}_m",
            f"its centre lies {ON_SEGMENT}",
            "mm",
            1e3,
            f"where on the segment it lies, {NOT_TOLD}",
        ),
    ),
    picture=Ball("mass_kg", "offset_{}_m"),
)


@dataclass(frozen=True)
class CarriedMass(InTrials):
    """A rigid load of mass m at r in the body's frame: more is required, so the signature is −Δrequired.

    With r₀ the segment's own centre of mass the load's pseudo-inertia is linear in m, m(r − r₀) and the six
    second moments about r₀. All ten are columns, so nothing is lost for a load far from r₀ or a wide one.
    """

    about = ABOUT

    between_others: bool = False  # upper arm or forearm

    @property
    def place_odds(self) -> float:
        """Hands hold, trunk, legs and feet have weights strapped to them; arms hardly ever."""
        return BETWEEN_OTHERS_ODDS if self.between_others else 0.0

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """Mass, three first moments and six second moments about the segment's centre of mass."""
        if self.target not in scene.skeleton.body_names or self.trial not in (None, scene.name):
            return None
        body = scene.skeleton.body_index(self.target)
        changes = load_basis(scene.skeleton.bodies[body].com_body)
        second = PRIOR_KG * SPREAD_M**2
        prior_std = np.concatenate([[PRIOR_KG], np.full(3, PRIOR_KG * REACH_M), np.full(6, second)])
        return Signature(-required_by_changes(scene, body, changes), prior_std)

    def estimates(
        self,
        scenes: Sequence[Scene],
        eta: Eta,
        eta_std: Eta,
        x: Float[np.ndarray, "10"],
        covariance: Float[np.ndarray, "10 10"],
    ) -> dict[str, Estimate]:
        """mass_kg, and the load's centre in the body's frame by division."""
        skeleton = scenes[0].skeleton
        com = skeleton.bodies[skeleton.body_index(self.target)].com_body
        mass = float(x[0])
        found = {"mass_kg": Estimate(mass, float(np.sqrt(covariance[0, 0])))}
        divisor = np.copysign(max(abs(mass), 1e-6), mass)
        for i, name in enumerate(("offset_x_m", "offset_y_m", "offset_z_m")):
            away = float(x[1 + i]) / divisor
            gradient = np.array([-away, 1.0]) / divisor
            both = covariance[np.ix_([0, 1 + i], [0, 1 + i])]
            found[name] = Estimate(float(com[i]) + away, float(np.sqrt(gradient @ both @ gradient)))
        return found

    def is_possible(self, estimates: dict[str, Estimate]) -> bool:
        """A load is never negative, and on the body."""
        away = float(np.hypot.reduce([estimates[f"offset_{axis}_m"].value for axis in "xyz"]))
        return estimates["mass_kg"].value > 0 and away < FARTHEST_M

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """Heavier than shoes, and a weight, not just a moment."""
        mass = estimates["mass_kg"]
        return self.is_possible(estimates) and mass.value > max(LEAST_KG, LEAST_STDS * mass.std)


def candidates(scenes: Sequence[Scene]) -> list[Candidate]:
    """On each body that weighs something: in all trials, and in each alone where there are several.

    Of somebody whom nobody weighed, what is carried all the time is not told from build.
    """
    if not scenes:
        return []
    skeleton = scenes[0].skeleton
    weighed = any(scene.weighed for scene in scenes)
    stretches = [t for t in all_and_each(scenes) if weighed or t is not None]
    inner = inner_arm_segments(skeleton)
    return [
        CarriedMass(skeleton.body_names[b], trial, b in inner)
        for trial in stretches
        for b in skeleton.bodies_from_share(LIGHTEST_SHARE)
    ]


def load_basis(centre_body: Float[np.ndarray, "3"]) -> Float[np.ndarray, "10 4 4"]:
    """Pseudo-inertias by mass, first and second moments (xx yy zz xy xz yz) about a point [m]."""
    shift = np.eye(4)
    shift[:3, 3] = centre_body
    basis = np.zeros((10, 4, 4))
    basis[0, 3, 3] = 1.0
    for k, (i, j) in enumerate(MOMENTS, start=1):
        basis[k, i, j] = basis[k, j, i] = 1.0
    return shift @ basis @ shift.T
