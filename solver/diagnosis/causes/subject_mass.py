"""Subject mass: the person weighs otherwise than was entered."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.diagnosis.causes.about import About, AtFault, Entry, Size, Weight
from solver.diagnosis.causes.effect import Candidate, Estimate, Eta, Signature
from solver.diagnosis.causes.readings import Reading
from solver.diagnosis.causes.scene import Scene, force_at

PRIOR_STD = 0.12  # relative: clothes and what people say they weigh, some percent; another adult's mass, 20
LEAST = 0.015  # relative: what a scale, a meal and shoes make
MOST = 0.35  # relative: other adults; beyond, forces are missing, or are given in other units


ABOUT = About(
    id="subject_mass",
    entry=Entry("`all`", "true mass = factor × entered mass", "`mass_factor`"),
    title="wrong body mass",
    sentence="The person's mass differs from the entered one.",
    remedy="Weigh the person with everything they wear, and enter that mass.",
    told_apart_by="the person on a scale, or a known weight on each plate",
    branch="body/whole mass",
    at_fault=AtFault.MODEL,
    weight=Weight.MASS,
    less_at_first=4.0,  # in 150 clean recordings it gains 0.4 at most
    asked_up_to=20.0,
    sizes=(
        Size("mass_factor", 0.015, 0.08, 0.35, "scales, clothes, shoes; beyond 0.08 it is another person's"),
    ),
    readings=(
        Reading(
            "mass_factor",
            "the person is {amount} {which} than entered",
            "%",
            1e2,
            zero=1.0,
            which=("heavier", "lighter"),
        ),
    ),
)


@dataclass(frozen=True)
class SubjectMass(Candidate):
    """All segments' inertias times mass_factor: mass_factor × required force is what the ground really gave.

    The force is exact at any size: true − recorded demand = −x × required with x = mass_factor − 1. Of the
    moments about the centre of mass nothing is claimed, although they grow likewise. They are the change of
    the body's spin, some N·m, much of it soft tissue and a generic model; a factor below 1 reduces it.
    In all of 13 sound real recordings their own factor is below 1, by 0.2 to 0.7 and up to 8 standard
    deviations, while weight gives 0.97 to 1.03: they would speak for a lighter body in each of them.
    """

    about = ABOUT

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """The force that the whole body demands, at its centre of mass, with its sign turned."""
        force = force_at(scene.required_ground[:, :3], scene.com_ground)
        return Signature(-force[:, :, None], np.array([PRIOR_STD]))

    def estimates(
        self,
        scenes: Sequence[Scene],
        eta: Eta,
        eta_std: Eta,
        x: Float[np.ndarray, "1"],
        covariance: Float[np.ndarray, "1 1"],
    ) -> dict[str, Estimate]:
        """mass_factor, dimensionless."""
        return {"mass_factor": Estimate(1 + float(x[0]), float(np.sqrt(covariance[0, 0])))}

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """Beyond a scale's reading and shoes, and of a size that a wrong entry has."""
        return LEAST < abs(estimates["mass_factor"].value - 1) < MOST


def candidates(scenes: Sequence[Scene]) -> list[Candidate]:
    """One person, if anybody entered what they weigh."""
    return [SubjectMass("all")] if any(scene.weighed for scene in scenes) else []
