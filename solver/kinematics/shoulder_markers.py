"""Markers that ride on a shoulder: they rise with it, and a body without a shoulder girdle cannot follow.

Lifting the arm overhead lifts and tilts the shoulder blade; the acromion moves by centimetres against the
trunk (Ludewig et al., J Bone Joint Surg Am 2009; 91: 378-389).
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from solver.skeleton.forward import ForwardKinematics
from solver.skeleton.skeleton import Skeleton

NEAR_SHOULDER_M = 0.12  # the acromion's skin lies 3 to 8 cm above the joint's centre
FURTHEST_M = 0.13  # a shoulder goes no further; at 19 cm from the acromion is C7, then the head
LEAST_WIDTH_M = 0.06  # from a shoulder to the middle of both; nearer, nobody knows what is inside
SHRUG = 0.8  # least cosine between where a marker went and up and inwards at 45°: within 37° of it


def shoulder_markers(skeleton: Skeleton) -> frozenset[str]:
    """Names of markers near a shoulder's centre on the trunk, if the upper arms hang on it directly."""
    kinematics = ForwardKinematics(skeleton)
    poses = kinematics.poses(skeleton.default_q[None])
    places, origins = kinematics.markers(poses)[0], poses.p_ground_body[0]
    found = set()
    for child, (name, joint) in enumerate(zip(skeleton.body_names, skeleton.joints, strict=True)):
        if not name.startswith("humerus") or joint.parent < 0 or not _carries_both(skeleton, joint.parent):
            continue
        for place, marker in zip(places, skeleton.markers, strict=True):
            if marker.body == joint.parent and np.linalg.norm(place - origins[child]) < NEAR_SHOULDER_M:
                found.add(marker.name)
    return frozenset(found)


def shrugged(
    marker: int,
    shoulders: Sequence[int],
    model_ground: Float[np.ndarray, "frames markers 3"],
    measured_ground: Float[np.ndarray, "frames markers 3"],
) -> bool:
    """Whether a marker on a shoulder lies above and inside the model's, as where the arm is lifted overhead.

    Above in the ground frame: of somebody who bends over it says no. The arm itself is not looked at.

    Args:
        marker: which one.
        shoulders: it and the others on both shoulders; of one alone nobody knows what is inside.
        model_ground: on the frames in question [m], y up.
        measured_ground: likewise; this marker is seen on all of them.
    """
    went = measured_ground[:, marker] - model_ground[:, marker]
    inwards = model_ground[:, shoulders].mean(axis=1) - model_ground[:, marker]
    inwards[:, 1] = 0.0
    width = np.linalg.norm(inwards, axis=1, keepdims=True)
    far = np.linalg.norm(went, axis=1)
    if width.min() < LEAST_WIDTH_M or far.max() > FURTHEST_M:
        return False
    expected = (inwards / width + [0.0, 1.0, 0.0]) / np.sqrt(2)
    return bool(np.median((went * expected).sum(axis=1) / far) > SHRUG)


def _carries_both(skeleton: Skeleton, body: int) -> bool:
    """Whether both arms hang on this body: then no shoulder blade lies between."""
    hanging = zip(skeleton.body_names, skeleton.joints, strict=True)
    return sum(name.startswith("humerus") and joint.parent == body for name, joint in hanging) > 1
