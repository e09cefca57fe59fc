"""The joints of a leg by the names that models of this family share."""

from jaxtyping import Float
from numpy import ndarray

from solver.fit import Fit
from solver.skeleton.forward import body_poses

JOINTS = {"hip": "femur", "knee": "tibia", "ankle": "talus"}  # to the body whose origin is its centre
# the segments before and behind each; between shank and foot the subtalar joint turns as well
SEGMENTS = {"hip": ("pelvis", "femur"), "knee": ("femur", "tibia"), "ankle": ("tibia", "calcn")}


def segments(joint: str, side: str) -> tuple[str, str]:
    """Names of the bodies before and behind a joint."""
    before, behind = SEGMENTS[joint]
    return before if before == "pelvis" else f"{before}_{side}", f"{behind}_{side}"


def joint_centres(fit: Fit, side: str) -> dict[str, Float[ndarray, "frames 3"]]:
    """Centres of hip, knee and ankle in the ground frame [m], of the first trial."""
    _, p = body_poses(fit.skeleton, fit.trials[0].motion.q)
    return {joint: p[:, fit.skeleton.body_index(f"{body}_{side}")] for joint, body in JOINTS.items()}
