"""Forces on pelvis or trunk whose point of attack is known to a hand's breadth: a harness, a band, a drag."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from solver.diagnosis.causes.about import (
    NOT_SHOWN,
    About,
    AgainstMotion,
    Arrow,
    AtFault,
    Band,
    Entry,
    Named,
    Place,
    Reading,
    Size,
    Steady,
    Weight,
)
from solver.diagnosis.causes.effect import (
    Candidate,
    Estimate,
    Eta,
    Fitted,
    InTrials,
    Nonlinear,
    Signature,
    all_and_each,
)
from solver.diagnosis.causes.observed_trial import Scene
from solver.diagnosis.causes.on_segments import REACH_M, columns_at_centre, prior_with_reach, trunk_bodies

SUPPORT_STD_N = 120.0  # supports carry a tenth to a half of the weight
MOST_SHARE = 0.8  # of body weight; with more, nobody stands
DISTANCES_M = (1.2, 4.0)  # of the anchors from which the search begins
STEP_M = 0.4
FARTHEST_M = 30.0  # of an anchor: any laboratory
ANCHOR_STD_M = 3.0  # before the data: within the laboratory
NEAREST_M = 0.05  # a band has a length
TENSION_STD_N = 40.0
STIFFNESS_STD_N_PER_M = 150.0
LEAST_TENSION_N = 10.0  # a slack band
DRAG_STD_NS_PER_M = 20.0
LEAST_DRAG_N = 8.0  # still air against a walker: below 1 N; against a sprinter: 15 N
SLOWEST_M_PER_S = 1e-6  # keeps powers of the speed finite


@dataclass(frozen=True)
class OnTrunk(InTrials):
    """A force on the pelvis or the trunk."""

    weight_N: float = np.inf  # of the person

    @classmethod
    def candidates(cls, scenes: Sequence[Scene]) -> list[Candidate]:
        """At both, in all trials and in each alone."""
        bodies = trunk_bodies(scenes[0].skeleton) if scenes else ()
        return [cls(name, trial, scenes[0].weight_N) for trial in all_and_each(scenes) for name in bodies]

    def signature(self, scene: Scene, eta: Eta) -> Signature | None:
        """None where the model has no such segment, or in other trials."""
        if self.target not in scene.skeleton.body_names or not self.own((scene,)):
            return None
        return self.on_body(scene, scene.skeleton.body_index(self.target), eta)

    @abstractmethod
    def on_body(self, scene: Scene, body: int, eta: Eta) -> Signature:
        """What it adds to the measured wrench."""

    def place(self, scene: Scene) -> Float[np.ndarray, "frames 3"]:
        """The segment's centre of mass [m]."""
        body = scene.skeleton.body_index(self.target)
        return scene.point_ground(body, scene.skeleton.bodies[body].com_body)


@dataclass(frozen=True)
class BodyWeightSupport(OnTrunk):
    """A constant force straight up on a segment, at its centre of mass or a hand's breadth from it."""

    about = About(
        id="body_weight_support",
        entry=Entry("body", "a constant force upward", "`force_N`"),
        title="an unmeasured support: {target}",
        sentence="A harness or a hand carries {target} with a constant force.",
        remedy="Record the support's load cell, or enter its setting.",
        separate_by="a second without contact with the plates, or the support's own load cell",
        branch="on the person/steady",
        names=Named.BODIES,
        at_fault=AtFault.MOVEMENT,
        weight=Weight.SUPPORT,
        odds_against=1.0,
        sizes=(Size("force_N", 40.0, 200.0, 800.0, "a body weight at most"),),
        readings=(Reading("force_N", "it lifts with {amount}", "N"),),
        picture=Arrow(Steady(upward="force_N")),
    )
    parameters = ("force_N",)
    least = 20.0  # [N] a slack harness, and 3 % of body weight

    def on_body(self, scene: Scene, body: int, eta: Eta) -> Signature:
        """A newton upward."""
        gravity = np.asarray(scene.skeleton.gravity)
        up = np.tile(-gravity / np.linalg.norm(gravity), (scene.frames, 1))
        return Signature(columns_at_centre(scene, body, up), prior_with_reach(SUPPORT_STD_N))

    def lifted_N(self, trial: str, estimates: dict[str, Estimate]) -> float:
        """Its force, in its trials."""
        return estimates["force_N"].value if self.trial in (None, trial) else 0.0

    def is_possible(self, estimates: dict[str, Estimate]) -> bool:
        """A harness never pushes down, nor lifts the person off the ground."""
        return 0 < estimates["force_N"].value < MOST_SHARE * self.weight_N


@dataclass(frozen=True)
class ElasticTether(OnTrunk):
    """A tension T + k (ℓ − ℓ̄) along the line to the anchor, ℓ its length and ℓ̄ the mean of that.

    η is the anchor in the ground frame; T and k act linearly, so the signature is exact while the band is
    taut: rest length = ℓ̄ − T/k. A band that goes slack now and then is described by what it does on average.
    """

    about = About(
        id="elastic_tether",
        entry=Entry(
            "body",
            "an elastic band to a fixed point",
            "`stiffness_N_per_m`, `mean_force_N`, `anchor_x_m`, `anchor_y_m`, `anchor_z_m`, `rest_length_m`",
        ),
        title="an elastic band: {target}",
        sentence="An elastic band pulls {target} towards a fixed point.",
        remedy="Put a load cell into the band, or take it off.",
        separate_by="a trial that moves to and from the anchor, or one without the band",
        branch="on the person/steady",
        names=Named.BODIES,
        at_fault=AtFault.MOVEMENT,
        odds_against=10.0,
        sizes=(Size("mean_force_N", 40.0, 200.0, 800.0, "a body weight at most"),),
        readings=(
            Reading("mean_force_N", "it pulls with {amount} on average", "N"),
            Reading("stiffness_N_per_m", "stiffness {amount}", "N/m"),
            Place(
                "anchor_{}_m", "fixed in the room at {point}", "m", unknown=f"where it is fixed, {NOT_SHOWN}"
            ),
            Reading("rest_length_m", "slack below a length of {amount}", "m"),
        ),
        picture=Arrow(Band("mean_force_N", "stiffness_N_per_m", "rest_length_m", "anchor_{}_m")),
    )

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

    def on_body(self, scene: Scene, body: int, eta: Eta) -> Signature:
        """Mean tension, stiffness, and the belt's offset from the centre of mass."""
        towards, length = self._line(scene, eta)
        tension = columns_at_centre(scene, body, towards)
        stiffness = (length - length.mean())[:, None, None] * tension[:, :, :1]
        prior = np.array([TENSION_STD_N, STIFFNESS_STD_N_PER_M, *(3 * [TENSION_STD_N * REACH_M])])
        return Signature(np.concatenate([tension[:, :, :1], stiffness, tension[:, :, 1:]], axis=2), prior)

    def estimates(self, scenes: Sequence[Scene], fit: Fitted) -> dict[str, Estimate]:
        """stiffness_N_per_m, mean_force_N, the anchor, and rest_length_m by division."""
        std = np.sqrt(np.diag(fit.covariance))
        tension, stiffness = float(fit.x[0]), float(fit.x[1])
        divisor = np.copysign(max(abs(stiffness), 1e-3), stiffness)
        mean = float(np.mean([self._line(s, fit.eta)[1].mean() for s in self.own(scenes)]))
        gradient = np.array([-1.0, tension / divisor]) / divisor
        rest_std = float(
            np.sqrt(gradient @ fit.covariance[:2, :2] @ gradient + max(fit.eta_std, default=0.0) ** 2)
        )
        return {
            "stiffness_N_per_m": Estimate(stiffness, float(std[1])),
            "mean_force_N": Estimate(tension, float(std[0])),
            "anchor_x_m": Estimate(fit.eta[0], fit.eta_std[0]),
            "anchor_y_m": Estimate(fit.eta[1], fit.eta_std[1]),
            "anchor_z_m": Estimate(fit.eta[2], fit.eta_std[2]),
            "rest_length_m": Estimate(mean - tension / divisor, rest_std),
        }

    def is_possible(self, estimates: dict[str, Estimate]) -> bool:
        """A band never pushes."""
        return estimates["mean_force_N"].value > 0

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """A band pulls, and pulls more when it is longer."""
        stiffness = estimates["stiffness_N_per_m"]
        return estimates["mean_force_N"].value > LEAST_TENSION_N and stiffness.value + 2 * stiffness.std > 0

    def _middle(self, scenes: Sequence[Scene]) -> Float[np.ndarray, "3"]:
        return np.mean([self.place(s).mean(axis=0) for s in self.own(scenes)], axis=0)

    def _line(
        self, scene: Scene, eta: Eta
    ) -> tuple[Float[np.ndarray, "frames 3"], Float[np.ndarray, " frames"]]:
        """Direction towards the anchor, and distance from it [m]."""
        offset = np.array(eta) - self.place(scene)
        length = np.maximum(np.linalg.norm(offset, axis=1), NEAREST_M)
        return offset / length[:, None], length


@dataclass(frozen=True)
class Drag(OnTrunk):
    """−b v (|v| / 1 m/s)^(exponent − 1) at a segment's centre of mass, v its velocity in the ground frame.

    The medium rests in the laboratory. On a treadmill that is the air; what is tied to the wall behind pulls
    there with a force that hardly depends on the velocity, and is found as a tether.
    """

    about = About(
        id="drag",
        entry=Entry(
            "body",
            "a force against the motion, growing with a power of speed",
            "`b_Ns_per_m` (at 1 m/s), `mean_force_N`, `exponent`",
        ),
        title="a drag or tow: {target}",
        sentence="Something brakes {target}, the more the faster it moves.",
        remedy="Record the towing force, or repeat the trial without it.",
        separate_by="the same walk at two speeds, and in both directions",
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
    nonlinear = (
        # viscous and quadratic; dry friction has 0, a parachute 2
        Nonlinear("exponent", (1.0, 2.0), step=0.3, bounds=(0.5, 2.5), prior=(1.25, 0.5)),
    )

    def on_body(self, scene: Scene, body: int, eta: Eta) -> Signature:
        """A unit of b, and the point's offset from the centre of mass."""
        columns = columns_at_centre(scene, body, self._time_history(scene, eta[0]))
        return Signature(columns, prior_with_reach(DRAG_STD_NS_PER_M))

    def estimates(self, scenes: Sequence[Scene], fit: Fitted) -> dict[str, Estimate]:
        """b_Ns_per_m (at 1 m/s), mean_force_N (of the magnitude), exponent."""
        b, std = float(fit.x[0]), float(np.sqrt(fit.covariance[0, 0]))
        time_histories = np.concatenate([self._time_history(s, fit.eta[0]) for s in self.own(scenes)])
        size = float(np.linalg.norm(time_histories, axis=1).mean())
        return {
            "b_Ns_per_m": Estimate(b, std),
            "mean_force_N": Estimate(b * size, std * size),
            "exponent": Estimate(fit.eta[0], fit.eta_std[0]),
        }

    def is_notable(self, estimates: dict[str, Estimate]) -> bool:
        """It brakes, and more than still air."""
        return estimates["mean_force_N"].value > LEAST_DRAG_N

    def _time_history(self, scene: Scene, exponent: float) -> Float[np.ndarray, "frames 3"]:
        velocity = CubicSpline(scene.times, self.place(scene))(scene.times, 1)
        speed = np.maximum(np.linalg.norm(velocity, axis=1, keepdims=True), SLOWEST_M_PER_S)
        return -(speed ** (exponent - 1)) * velocity
