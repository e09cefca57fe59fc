"""Elastic tether: a rubber band or a spring ties the person to a point of the laboratory."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.diagnosis.causes.about import About, AtFault, Entry, Named, Size
from solver.diagnosis.causes.effect import Candidate, Estimate, Eta, InTrials, Signature, all_and_each
from solver.diagnosis.causes.force_on_body import REACH_M, columns_at_centre, trunk_bodies
from solver.diagnosis.causes.pictures import Arrow, Band
from solver.diagnosis.causes.readings import NOT_TOLD, Place, Reading
from solver.diagnosis.causes.scene import Scene

DISTANCES_M = (1.2, 4.0)  # of the anchors from which the search begins
STEP_M = 0.4
FARTHEST_M = 30.0
ANCHOR_STD_M = 3.0  # before the data: within the laboratory
NEAREST_M = 0.05  # a band has a length
TENSION_STD_N = 40.0
STIFFNESS_STD_N_PER_M = 150.0
LEAST_N = 10.0  # a slack band


ABOUT = About(
    id="elastic_tether",
    entry=Entry(
        "body",
        "an elastic band to a fixed point",
        "`stiffness_N_per_m`, `mean_force_N`, `anchor_x_m`, `anchor_y_m`, `anchor_z_m`, `rest_length_m`",
    ),
    title="an elastic band: {target}",
    sentence="An elastic band pulls {target} towards a fixed point.",
    remedy="Put a load cell into the band, or take it off.",
    told_apart_by="a trial that moves to and from the anchor, or one without the band",
    branch="on the person/steady",
    names=Named.BODIES,
    at_fault=AtFault.MOVEMENT,
    odds_against=10.0,
    sizes=(Size("mean_force_N", 40.0, 200.0, 800.0, "a body weight at most"),),
    readings=(
        Reading("mean_force_N", "it pulls with {amount} on average", "N"),
        Reading("stiffness_N_per_m", "stiffness {amount}", "N/m"),
        Place("anchor_{}_m", "fixed in the room at {point}", "m", unknown=f"where it is fixed, {NOT_TOLD}"),
        Reading("rest_length_m", "slack below a length of {amount}", "m"),
    ),
    picture=Arrow(Band("mean_force_N", "stiffness_N_per_m", "rest_length_m", "anchor_{}_m")),
)


@dataclass(frozen=True)
class ElasticTether(InTrials):
    """A tension T + k (ℓ − ℓ̄) along the line to the anchor, ℓ its length and ℓ̄ the mean of that.

    η is the anchor in the ground frame; T and k act linearly, so the signature is exact while the band is
    taut: rest length = ℓ̄ − T/k. A band that goes slack now and then is described by what it does on average.
    """

    about = ABOUT

    def starts(self, scenes: Sequence[Scene]) -> tuple[Eta, ...]:
        """Anchors all round the body's mean place, near and far, and above it."""
        middle = self._middle(scenes)
        directions = np.array([(1, 0, 0), (-1, 0, 0), (0, 0, 1), (0, 0, -1), (0, 1, 0)], dtype=float)
        return tuple(tuple((middle + distance * d).tolist()) for distance in DISTANCES_M for d in directions)

    def steps(self) -> Eta:
        """Of the anchor [m]."""
        return (STEP_M, STEP_M, STEP_M)

    def prior(self, scenes: Sequence[Scene]) -> tuple[tuple[float, float], ...]:
        """Somewhere in the laboratory."""
        return tuple((float(m), ANCHOR_STD_M) for m in self._middle(scenes))

    def admissible(self, eta: Eta) -> bool:
        """Within any laboratory."""
        return bool(np.abs(eta).max() < FARTHEST_M)

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """Mean tension, stiffness, and the belt's offset from the centre of mass."""
        if self.target not in scene.skeleton.body_names or not self.own((scene,)):
            return None
        body = scene.skeleton.body_index(self.target)
        towards, length = self._line(scene, eta)
        tension = columns_at_centre(scene, body, towards)
        stiffness = (length - length.mean())[:, None, None] * tension[:, :, :1]
        prior = np.array([TENSION_STD_N, STIFFNESS_STD_N_PER_M, *(3 * [TENSION_STD_N * REACH_M])])
        return Signature(np.concatenate([tension[:, :, :1], stiffness, tension[:, :, 1:]], axis=2), prior)

    def estimates(
        self,
        scenes: Sequence[Scene],
        eta: Eta,
        eta_std: Eta,
        x: Float[np.ndarray, "5"],
        covariance: Float[np.ndarray, "5 5"],
    ) -> dict[str, Estimate]:
        """stiffness_N_per_m, mean_force_N, the anchor, and rest_length_m by division."""
        std = np.sqrt(np.diag(covariance))
        tension, stiffness = float(x[0]), float(x[1])
        divisor = np.copysign(max(abs(stiffness), 1e-3), stiffness)
        mean = float(np.mean([self._line(s, eta)[1].mean() for s in self.own(scenes)]))
        gradient = np.array([-1.0, tension / divisor]) / divisor
        rest_std = float(np.sqrt(gradient @ covariance[:2, :2] @ gradient + max(eta_std, default=0.0) ** 2))
        return {
            "stiffness_N_per_m": Estimate(stiffness, float(std[1])),
            "mean_force_N": Estimate(tension, float(std[0])),
            "anchor_x_m": Estimate(eta[0], eta_std[0]),
            "anchor_y_m": Estimate(eta[1], eta_std[1]),
            "anchor_z_m": Estimate(eta[2], eta_std[2]),
            "rest_length_m": Estimate(mean - tension / divisor, rest_std),
        }

    def is_possible(self, estimates: dict[str, Estimate]) -> bool:
        """A band never pushes."""
        return estimates["mean_force_N"].value > 0

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """A band pulls, and pulls more when it is longer."""
        stiffness = estimates["stiffness_N_per_m"]
        return estimates["mean_force_N"].value > LEAST_N and stiffness.value + 2 * stiffness.std > 0

    def _place(self, scene: Scene) -> Float[np.ndarray, "frames 3"]:
        body = scene.skeleton.body_index(self.target)
        return scene.point_ground(body, scene.skeleton.bodies[body].com_body)

    def _middle(self, scenes: Sequence[Scene]) -> Float[np.ndarray, "3"]:
        return np.mean([self._place(s).mean(axis=0) for s in self.own(scenes)], axis=0)

    def _line(
        self, scene: Scene, eta: Eta
    ) -> tuple[Float[np.ndarray, "frames 3"], Float[np.ndarray, " frames"]]:
        """Direction towards the anchor, and distance from it [m]."""
        offset = np.array(eta) - self._place(scene)
        length = np.maximum(np.linalg.norm(offset, axis=1), NEAREST_M)
        return offset / length[:, None], length


def candidates(scenes: Sequence[Scene]) -> list[Candidate]:
    """At the pelvis and at the trunk."""
    bodies = trunk_bodies(scenes[0].skeleton) if scenes else ()
    return [ElasticTether(name, t) for t in all_and_each(scenes) for name in bodies]
