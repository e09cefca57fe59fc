"""Drag: air, water, a parachute or a sledge holds the person back."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from solver.diagnosis.causes.about import About, AtFault, Entry, Named, Size
from solver.diagnosis.causes.effect import Candidate, Estimate, Eta, InTrials, Signature, all_and_each
from solver.diagnosis.causes.force_on_body import columns_at_centre, prior_with_reach, trunk_bodies
from solver.diagnosis.causes.pictures import AgainstMotion, Arrow
from solver.diagnosis.causes.readings import Reading
from solver.diagnosis.causes.scene import Scene

EXPONENTS = (0.5, 2.5)  # bounds: dry friction has 0, a parachute 2
PRIOR_STD_NS_PER_M = 20.0
LEAST_N = 8.0  # still air against a walker: below 1 N; against a sprinter: 15 N
SLOWEST_M_PER_S = 1e-6  # keeps powers of the speed finite


ABOUT = About(
    id="drag",
    entry=Entry(
        "body",
        "a force against the motion, growing with a power of speed",
        "`b_Ns_per_m` (at 1 m/s), `mean_force_N`, `exponent`",
    ),
    title="a drag or tow: {target}",
    sentence="Something brakes {target}, the more the faster it moves.",
    remedy="Record the towing force, or repeat the trial without it.",
    told_apart_by="the same walk at two speeds, and in both directions",
    branch="on the person/with motion",
    names=Named.BODIES,
    at_fault=AtFault.MOVEMENT,
    odds_against=3.0,
    sizes=(Size("mean_force_N", 40.0, 200.0, 800.0, "a body weight at most"),),
    readings=(
        Reading("mean_force_N", "it brakes with {amount} on average", "N"),
        Reading("b_Ns_per_m", "{amount} at 1 m/s", "N"),
        Reading("exponent", "growing with speed to the power of {amount}", ""),
    ),
    picture=Arrow(AgainstMotion("b_Ns_per_m", "exponent")),
)


@dataclass(frozen=True)
class Drag(InTrials):
    """−b v (|v| / 1 m/s)^(exponent − 1) at a segment's centre of mass, v its velocity in the ground frame.

    The medium rests in the laboratory. On a treadmill that is the air; what is tied to the wall behind pulls
    there with a force that hardly depends on the velocity, and is found as a tether.
    """

    about = ABOUT

    def starts(self, scenes: Sequence[Scene]) -> tuple[Eta, ...]:
        """Exponents: viscous and quadratic."""
        return ((1.0,), (2.0,))

    def steps(self) -> Eta:
        """Of the exponent."""
        return (0.3,)

    def prior(self, scenes: Sequence[Scene]) -> tuple[tuple[float, float], ...]:
        """Of the exponent."""
        return ((1.25, 0.5),)

    def admissible(self, eta: Eta) -> bool:
        """Between dry friction and more than quadratic."""
        return EXPONENTS[0] <= eta[0] <= EXPONENTS[1]

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """A unit of b, and the point's offset from the centre of mass."""
        if self.target not in scene.skeleton.body_names or not self.own((scene,)):
            return None
        body = scene.skeleton.body_index(self.target)
        return Signature(
            columns_at_centre(scene, body, self._time_history(scene, eta[0])),
            prior_with_reach(PRIOR_STD_NS_PER_M),
        )

    def estimates(
        self,
        scenes: Sequence[Scene],
        eta: Eta,
        eta_std: Eta,
        x: Float[np.ndarray, "4"],
        covariance: Float[np.ndarray, "4 4"],
    ) -> dict[str, Estimate]:
        """b_Ns_per_m (at 1 m/s), mean_force_N (of the magnitude), exponent."""
        b, std = float(x[0]), float(np.sqrt(covariance[0, 0]))
        time_histories = np.concatenate([self._time_history(s, eta[0]) for s in self.own(scenes)])
        size = float(np.linalg.norm(time_histories, axis=1).mean())
        return {
            "b_Ns_per_m": Estimate(b, std),
            "mean_force_N": Estimate(b * size, std * size),
            "exponent": Estimate(eta[0], eta_std[0]),
        }

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """It brakes, and more than still air."""
        return estimates["mean_force_N"].value > LEAST_N

    def _time_history(self, scene: Scene, exponent: float) -> Float[np.ndarray, "frames 3"]:
        body = scene.skeleton.body_index(self.target)
        place = scene.point_ground(body, scene.skeleton.bodies[body].com_body)
        velocity = CubicSpline(scene.times, place)(scene.times, 1)
        speed = np.maximum(np.linalg.norm(velocity, axis=1, keepdims=True), SLOWEST_M_PER_S)
        return -(speed ** (exponent - 1)) * velocity


def candidates(scenes: Sequence[Scene]) -> list[Candidate]:
    """At the pelvis and at the trunk."""
    bodies = trunk_bodies(scenes[0].skeleton) if scenes else ()
    return [Drag(name, t) for t in all_and_each(scenes) for name in bodies]
