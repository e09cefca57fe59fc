"""What networks see of a frame and learn to tell: nothing depends on where a person goes or faces."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from addb_viewer.benchmark.differences import central_differences
from addb_viewer.benchmark.scoring import HISTORY, STRIDE
from addb_viewer.benchmark.task import Measured, Seen
from addb_viewer.dataset.columns import COORDINATE_NAMES
from solver.kinematics.root_joint import root_joint
from solver.skeleton.forward import body_poses
from solver.skeleton.skeleton import Skeleton

BELOW_ROOT = COORDINATE_NAMES[6:]
# A coordinate of each joint whose centre is shown; models name joints differently, but these alike.
JOINTS = (
    *(f"{name}_{side}" for side in "rl" for name in ("hip_flexion", "knee_angle", "ankle_angle")),
    *(f"{name}_{side}" for side in "rl" for name in ("subtalar_angle", "mtp_angle")),
    "lumbar_extension",
    *(f"{name}_{side}" for side in "rl" for name in ("arm_flex", "elbow_flex", "pro_sup", "wrist_flex")),
)
EARLIER = np.arange(STRIDE, HISTORY + STRIDE, STRIDE)  # frames before: the root's history in wide features
Features = Literal["plain", "wide"]
_PLAIN = 2 * len(BELOW_ROOT) + 3 + 1 + 3 + 3 + 3 * len(JOINTS)
SIZES: dict[Features, int] = {"plain": _PLAIN, "wide": _PLAIN + len(BELOW_ROOT) + 6 + 6 * len(EARLIER)}
TARGETS = 12  # of the right and the left foot: force, moment, over the mass, in the pelvis' axes


@dataclass(frozen=True)
class RootPose:
    """The root body's, ground frame."""

    R_ground_root: Float[np.ndarray, "frames 3 3"]
    p_ground: Float[np.ndarray, "frames 3"]  # [m]
    feet_ground: Float[np.ndarray, "frames feet 3"]  # origins of the feet's bodies [m]


def features_of(
    seen: Seen, features: Features = "plain"
) -> tuple[Float[np.ndarray, "frames features"], RootPose]:
    """Coordinates below the root, which way is up, the root's height; differences; centres of joints.

    Coordinates and joints that a model lacks are zero. Wide ones are as the dataset's public tools have them
    besides: first differences, and where the root was before.

    Args:
        seen: what is shown.
        features: "plain" as the paper says, or "wide".
    """
    skeleton = seen.skeleton
    R, p = body_poses(skeleton, seen.q)
    root = root_joint(skeleton)
    R_root, p_root = R[:, root.body], p[:, root.body]
    velocity, acceleration = central_differences(seen.q, seen.rate)
    slope, linear = central_differences(p_root, seen.rate)
    centres = np.zeros((seen.frames, len(JOINTS), 3))
    for k, body in enumerate(_bodies_of(skeleton)):
        if body is not None:
            centre = p[:, body] + R[:, body] @ skeleton.joints[body].p_child_frame
            centres[:, k] = _into(R_root, centre - p_root)
    pieces = [
        _named(seen.q, skeleton),
        R_root[:, 1, :],  # the ground's vertical in the root's axes
        p_root[:, 1:2],
        _named(acceleration, skeleton),
        _turning(R_root, seen.rate),
        _into(R_root, linear),
        centres.reshape(seen.frames, -1),
    ]
    if features == "wide":
        pieces += [_named(velocity, skeleton), _into(R_root, slope), _spin(R_root, seen.rate)]
        pieces.append(_history(R_root, p_root))
    feet = p[:, list(seen.feet)]
    return np.concatenate(pieces, axis=1), RootPose(R_root, p_root, feet)


def targets_of(seen: Seen, measured: Measured, pose: RootPose) -> Float[np.ndarray, "frames targets"]:
    """Force [N/kg] and moment [N·m/kg] on each foot in the root's axes, about the shown foot's origin.

    Args:
        seen: of the same frames.
        measured: NaN stays NaN.
        pose: of the shown motion.
    """
    lever = measured.foot_ground - pose.feet_ground
    moment = measured.moment + np.cross(lever, measured.force)
    both = np.stack([measured.force, moment], axis=2) / seen.mass_kg
    return np.einsum("tji,tfkj->tfki", pose.R_ground_root, both).reshape(seen.frames, TARGETS)


def wrenches_of(
    told: Float[np.ndarray, "frames targets"], seen: Seen, pose: RootPose
) -> tuple[Float[np.ndarray, "frames feet 3"], Float[np.ndarray, "frames feet 3"]]:
    """The way back: forces [N] and moments [N·m] in the ground's axes.

    Args:
        told: as `targets_of` gives them.
        seen: of the same frames.
        pose: of the shown motion.
    """
    both = np.einsum("tij,tfkj->tfki", pose.R_ground_root, told.reshape(-1, 2, 2, 3)) * seen.mass_kg
    return both[:, :, 0], both[:, :, 1]


def _named(values: Float[np.ndarray, "frames dofs"], skeleton: Skeleton) -> Float[np.ndarray, "frames named"]:
    named = np.zeros((len(values), len(BELOW_ROOT)))
    for k, name in enumerate(BELOW_ROOT):
        if name in skeleton.dofs:
            named[:, k] = values[:, skeleton.dofs.index(name)]
    return named


def _bodies_of(skeleton: Skeleton) -> list[int | None]:
    """The body below each of the joints; None where the model has no such coordinate."""
    moved = {axis.coordinate: b for b, joint in enumerate(skeleton.joints) for axis in joint.axes}
    return [moved.get(name) for name in JOINTS]


def _turning(R_ground_root: Float[np.ndarray, "frames 3 3"], rate: float) -> Float[np.ndarray, "frames 3"]:
    """Angular acceleration in the root's axes, by differences [rad/s²]; ends repeat their neighbours'."""
    steps = Rotation.from_matrix(R_ground_root[:-1].transpose(0, 2, 1) @ R_ground_root[1:]).as_rotvec()
    turning = np.empty((len(R_ground_root), 3))
    turning[1:-1] = (steps[1:] - steps[:-1]) * rate**2
    turning[0], turning[-1] = turning[1], turning[-2]
    return turning


def _spin(R_ground_root: Float[np.ndarray, "frames 3 3"], rate: float) -> Float[np.ndarray, "frames 3"]:
    """Angular velocity in the root's axes [rad/s]; ends repeat their neighbours'."""
    around = R_ground_root[:-2].transpose(0, 2, 1) @ R_ground_root[2:]
    spin = np.empty((len(R_ground_root), 3))
    spin[1:-1] = Rotation.from_matrix(around).as_rotvec() * rate / 2
    spin[0], spin[-1] = spin[1], spin[-2]
    return spin


def _history(
    R_ground_root: Float[np.ndarray, "frames 3 3"], p_ground: Float[np.ndarray, "frames 3"]
) -> Float[np.ndarray, "frames history"]:
    """Where the root was, and how it was turned, in its present axes [m, rad]; first the first frame."""
    at = np.maximum(np.arange(len(p_ground))[:, None] - EARLIER, 0)
    places = np.einsum("tji,tkj->tki", R_ground_root, p_ground[at] - p_ground[:, None])
    turned = R_ground_root[:, None].transpose(0, 1, 3, 2) @ R_ground_root[at]
    angles = Rotation.from_matrix(turned.reshape(-1, 3, 3)).as_rotvec()
    return np.concatenate([places, angles.reshape(places.shape)], axis=2).reshape(len(p_ground), -1)


def _into(
    R_ground_root: Float[np.ndarray, "frames 3 3"], vectors: Float[np.ndarray, "frames 3"]
) -> Float[np.ndarray, "frames 3"]:
    return np.einsum("tji,tj->ti", R_ground_root, vectors)
