"""Body-weight support: a harness carries part of the person."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.diagnosis.causes.about import About, AtFault, Entry, Named, Size, Weight
from solver.diagnosis.causes.effect import Candidate, Estimate, Eta, InTrials, Signature, all_and_each
from solver.diagnosis.causes.force_on_body import columns_at_centre, prior_with_reach, trunk_bodies
from solver.diagnosis.causes.pictures import Arrow, Steady
from solver.diagnosis.causes.readings import Reading
from solver.diagnosis.causes.scene import Scene

PRIOR_STD_N = 120.0  # supports carry a tenth to a half of the weight
LEAST_N = 20.0  # a slack harness, and 3 % of body weight
MOST_SHARE = 0.8  # of body weight; with more, nobody stands


ABOUT = About(
    id="body_weight_support",
    entry=Entry("body", "a constant force upward", "`force_N`"),
    title="an unmeasured support: {target}",
    sentence="A harness or a hand carries {target} with a constant force.",
    remedy="Record the support's load cell, or enter its setting.",
    told_apart_by="a second without contact with the plates, or the support's own load cell",
    branch="on the person/steady",
    names=Named.BODIES,
    at_fault=AtFault.MOVEMENT,
    weight=Weight.SUPPORT,
    odds_against=1.0,
    sizes=(Size("force_N", 40.0, 200.0, 800.0, "a body weight at most"),),
    readings=(Reading("force_N", "it lifts with {amount}", "N"),),
    picture=Arrow(Steady(upward="force_N")),
)


@dataclass(frozen=True)
class BodyWeightSupport(InTrials):
    """A constant force straight up on a segment, at its centre of mass or a hand's breadth from it."""

    about = ABOUT

    weight_N: float = np.inf  # of the person

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """A newton upward."""
        if self.target not in scene.skeleton.body_names or not self.own((scene,)):
            return None
        gravity = np.asarray(scene.skeleton.gravity)
        up = np.tile(-gravity / np.linalg.norm(gravity), (scene.frames, 1))
        columns = columns_at_centre(scene, scene.skeleton.body_index(self.target), up)
        return Signature(columns, prior_with_reach(PRIOR_STD_N))

    def estimates(
        self,
        scenes: Sequence[Scene],
        eta: Eta,
        eta_std: Eta,
        x: Float[np.ndarray, "4"],
        covariance: Float[np.ndarray, "4 4"],
    ) -> dict[str, Estimate]:
        """force_N, on the person."""
        return {"force_N": Estimate(float(x[0]), float(np.sqrt(covariance[0, 0])))}

    def lifted_N(self, trial: str, estimates: dict[str, Estimate]) -> float:
        """Its force, in its trials."""
        return estimates["force_N"].value if self.trial in (None, trial) else 0.0

    def is_possible(self, estimates: dict[str, Estimate]) -> bool:
        """A harness never pushes down, nor lifts the person off the ground."""
        return 0 < estimates["force_N"].value < MOST_SHARE * self.weight_N

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """More than a slack harness."""
        return self.is_possible(estimates) and estimates["force_N"].value > LEAST_N


def candidates(scenes: Sequence[Scene]) -> list[Candidate]:
    """At the pelvis and at the trunk, in all trials and in each alone."""
    bodies = trunk_bodies(scenes[0].skeleton) if scenes else ()
    return [BodyWeightSupport(name, t, scenes[0].weight_N) for t in all_and_each(scenes) for name in bodies]
