"""The joints of a leg by the names that models of this family share, as a fit poses them."""

from dataclasses import dataclass

from jaxtyping import Float
from numpy import ndarray

from solver.fitting.fit import Fit
from solver.skeleton.forward import body_poses

JOINTS = {"hip": "femur", "knee": "tibia", "ankle": "talus"}  # to the body whose origin is its centre
# the segments before and behind each; between shank and foot the subtalar joint turns as well
SEGMENTS = {"hip": ("pelvis", "femur"), "knee": ("femur", "tibia"), "ankle": ("tibia", "calcn")}

Poses = tuple[
    Float[ndarray, "frames 3 3"], Float[ndarray, "frames 3"]
]  # rotation and origin [m], ground frame


@dataclass(frozen=True)
class PosedFit:
    """A fit and where its bodies are in its first trial."""

    fit: Fit
    R_ground_body: Float[ndarray, "frames bodies 3 3"]
    p_ground_body: Float[ndarray, "frames bodies 3"]  # [m]

    def segments(self, joint: str, side: str) -> tuple[Poses, Poses]:
        """The bodies before and behind a joint."""
        before, behind = segments(joint, side)
        return self._body(before), self._body(behind)

    def joint_centres(self, side: str) -> dict[str, Float[ndarray, "frames 3"]]:
        """Centres of hip, knee and ankle in the ground frame [m]."""
        return {joint: self._body(f"{body}_{side}")[1] for joint, body in JOINTS.items()}

    def _body(self, name: str) -> Poses:
        i = self.fit.skeleton.body_index(name)
        return self.R_ground_body[:, i], self.p_ground_body[:, i]


def posed(fit: Fit) -> PosedFit:
    """The fit with its bodies posed."""
    return PosedFit(fit, *body_poses(fit.skeleton, fit.trials[0].motion.q))


def segments(joint: str, side: str) -> tuple[str, str]:
    """Names of the bodies before and behind a joint."""
    before, behind = SEGMENTS[joint]
    return before if before == "pelvis" else f"{before}_{side}", f"{behind}_{side}"
