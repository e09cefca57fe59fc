"""A model of the subject's own without markers for the recording: landmarks placed on its bodies.

Bodies of the same name are taken for the same segment where their frames agree: in the neutral pose both are
turned alike, and the joint centres that they carry lie alike. Places go over in proportion to the segment.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from solver.kinematics.marker_matching import FEWEST_SHARED
from solver.kinematics.nonsense_on_own_model import ALIKE_M
from solver.skeleton.forward import body_poses, carried_joint_centres
from solver.skeleton.skeleton import Marker, Skeleton

TURNED_ALIKE = np.radians(20.0)
NEAR_M = 0.05  # a joint centre nearer to the body's origin tells no proportion


def is_bare(model: Skeleton) -> bool:
    """Whether a model came without a marker set."""
    return len(model.markers) < FEWEST_SHARED


def placed_on_model(markers: Sequence[Marker], default: Skeleton, model: Skeleton) -> dict[str, Marker]:
    """Markers of the default body on another model's bodies, by name; those that find none are left out.

    Args:
        markers: on the default body.
        default: the default body, unscaled.
        model: the subject's own, scaled or not.
    """
    ratio = _proportions(default, model)
    return {
        marker.name: replace(
            marker,
            body=model.body_index(default.body_names[marker.body]),
            position_body=ratio[default.body_names[marker.body]] * marker.position_body,
        )
        for marker in markers
        if default.body_names[marker.body] in ratio
    }


def _proportions(default: Skeleton, model: Skeleton) -> dict[str, float]:
    """Size of each segment of the model, with that of the default body as one, where frames agree.

    Joints that lie otherwise are set aside as long as others agree. A segment that shares no joint with the
    other body's (a hand) has the size of the one that it hangs on. Nothing where the root's frames differ.
    """
    carried_here, carried_there = (carried_joint_centres(s, np.zeros(len(s.dofs))) for s in (default, model))
    R_here, R_there = _neutral(default), _neutral(model)
    ratio: dict[str, float] = {}
    for b, name in enumerate(default.body_names):
        if name not in model.body_names:
            continue
        if _angle(R_here[b].T @ R_there[model.body_index(name)]) > TURNED_ALIKE:
            continue
        ours, theirs = carried_here[name], carried_there[name]
        shared = [child for child in ours if child in theirs and np.linalg.norm(ours[child]) > NEAR_M]
        parent = default.joints[b].parent
        if not shared:
            inherited = ratio.get(default.body_names[parent]) if parent >= 0 else None
            if inherited is not None:
                ratio[name] = inherited
            continue
        one = np.array([ours[child] for child in shared])
        other = np.array([theirs[child] for child in shared])
        size = _size(one, other)
        if size is not None:
            ratio[name] = size
    return ratio if default.body_names[0] in ratio else {}


def _size(one: Float[np.ndarray, "joints 3"], other: Float[np.ndarray, "joints 3"]) -> float | None:
    """Ratio of two sets of joint centres, the worst set aside until the rest agree; None where none do."""
    while len(one):
        size = float(np.linalg.norm(other) / np.linalg.norm(one))
        apart = np.linalg.norm(other - size * one, axis=1)
        if apart.mean() < ALIKE_M:
            return size
        keep = np.arange(len(one)) != np.argmax(apart)
        one, other = one[keep], other[keep]
    return None


def _neutral(skeleton: Skeleton) -> Float[np.ndarray, "bodies 3 3"]:
    """Orientations of the bodies with all coordinates at zero; ground frame."""
    return body_poses(skeleton, np.zeros((1, len(skeleton.dofs))))[0][0]


def _angle(R: Float[np.ndarray, "3 3"]) -> float:
    """By which a rotation turns [rad]."""
    return float(np.arccos(np.clip((np.trace(R) - 1) / 2, -1.0, 1.0)))
