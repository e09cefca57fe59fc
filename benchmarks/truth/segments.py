"""Masses and lengths of segments, the fit's beside the true ones."""

from collections.abc import Mapping

import numpy as np

from solver.skeleton.forward import body_poses
from solver.skeleton.skeleton import Skeleton

PARTS = {
    "trunk": ("pelvis", "torso"),
    "thigh": ("femur_r", "femur_l"),
    "shank": ("tibia_r", "tibia_l"),
    "foot": tuple(f"{bone}_{side}" for bone in ("talus", "calcn", "toes") for side in "rl"),
}  # masses of both sides together: the fit ties them
LENGTHS = {
    "hip width": ("femur_r", "femur_l"),
    "thigh": ("femur_r", "tibia_r"),
    "shank": ("tibia_r", "talus_r"),
    "foot": ("calcn_r", "toes_r"),
}  # between the origins of these bodies


def mass_ratios(fitted: Skeleton, true: Skeleton) -> dict[str, float]:
    """Fitted over true mass, by part of the body."""
    ours, theirs = _masses(fitted), _masses(true)
    return {
        part: float(sum(ours[n] for n in names) / sum(theirs[n] for n in names))
        for part, names in PARTS.items()
        if all(n in ours and n in theirs for n in names)
    } | {"body": float(fitted.mass / true.mass)}


def length_errors_mm(fitted: Skeleton, true: Skeleton) -> dict[str, float]:
    """Fitted less true length [mm], in the models' neutral poses."""
    ours, theirs = _lengths(fitted), _lengths(true)
    return {name: 1000 * (ours[name] - theirs[name]) for name in ours.keys() & theirs.keys()}


def _masses(skeleton: Skeleton) -> Mapping[str, float]:
    return {body.name: body.mass for body in skeleton.bodies}


def _lengths(skeleton: Skeleton) -> dict[str, float]:
    q = skeleton.default_q.copy()
    for i, dof in enumerate(skeleton.dofs):
        if dof.startswith("knee_angle"):
            q[i] = 0.0  # models' knees slide as they bend
    _, p = body_poses(skeleton, q[None])
    place = dict(zip(skeleton.body_names, p[0], strict=True))
    return {
        name: float(np.linalg.norm(place[a] - place[b]))
        for name, (a, b) in LENGTHS.items()
        if a in place and b in place
    }
