"""Joint centres from raw markers alone, as a judge between two skeletons that disagree.

Two rigid clusters that share a joint turn about one point. Of each frame R₁ c₁ + p₁ = R₂ c₂ + p₂, with the
clusters' measured poses; all frames together give c₁ and c₂ by least squares (the symmetrical centre of
rotation estimation: Ehrig et al., J Biomech 2006; 39: 2798-2809). No skeleton is asked. Along the axis that a
leg mostly turns about, the point is unknown, so it is looked for in the plane across that axis only.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from solver.fit import Fit
from solver.skeleton.forward import body_poses
from solver.skeleton.rotations import nearest_rotation

# the bodies on both sides of each joint, and the one whose origin is its centre
CLUSTERS = {
    "hip": ("pelvis", ("femur",), "femur"),
    "knee": ("femur", ("tibia",), "tibia"),
    "ankle": ("tibia", ("talus", "calcn"), "talus"),
}
FEWEST_MARKERS = 3  # of a cluster
FEWEST_FRAMES = 20  # that show both clusters whole
MOST_FRAMES = 400  # more tell nothing new


def off_functional_centre(fit: Fit, clusters_of: Fit, joint: str, side: str) -> float | None:
    """How far a fit's joint centre lies from the functional one, across the joint's axis [m].

    Args:
        fit: whose centre is judged.
        clusters_of: the fit whose model says which marker is on which body; the same recording.
        joint: "hip", "knee" or "ankle".
        side: "r" or "l".

    Returns:
        None where fewer than three markers are on either body, or too few frames show them all.
    """
    parent, children, at = CLUSTERS[joint]
    here = parent if parent == "pelvis" else f"{parent}_{side}"
    observed = clusters_of.trials[0].capture.markers.positions_ground
    columns = [_columns(clusters_of, bodies) for bodies in ((here,), tuple(f"{c}_{side}" for c in children))]
    if min(len(c) for c in columns) < FEWEST_MARKERS:
        return None
    together = np.isfinite(observed[:, columns[0] + columns[1]]).all(axis=(1, 2))
    chosen = np.flatnonzero(together)
    if len(chosen) < FEWEST_FRAMES:
        return None
    chosen = chosen[:: max(1, len(chosen) // MOST_FRAMES)]
    poses = [cluster_poses(observed[chosen][:, c]) for c in columns]
    R, p = body_poses(fit.skeleton, fit.trials[0].motion.q)
    index = fit.skeleton.body_index
    return off_centre(
        poses[0], poses[1], p[chosen, index(f"{at}_{side}")], R[chosen, index(f"{at}_{side}"), :, 2]
    )


def off_centre(
    parent: tuple[Float[np.ndarray, "frames 3 3"], Float[np.ndarray, "frames 3"]],
    child: tuple[Float[np.ndarray, "frames 3 3"], Float[np.ndarray, "frames 3"]],
    centre_ground: Float[np.ndarray, "frames 3"],
    axis_ground: Float[np.ndarray, "frames 3"],
) -> float:
    """Distance of a joint's centre from the point that two clusters turn about, across the axis [m].

    Args:
        parent: rotation and origin of the cluster before the joint, in the ground frame.
        child: likewise of the one behind it.
        centre_ground: the centre to be judged [m].
        axis_ground: about which the joint mostly turns.
    """
    (R1, p1), (R2, p2) = parent, child
    in_parent = np.median(np.einsum("tji,tj->ti", R1, centre_ground - p1), axis=0)
    axis = np.einsum("tji,tj->ti", R1, axis_ground).mean(axis=0)
    plane = np.linalg.svd(axis[None])[2][1:].T  # two directions across the axis
    A = np.concatenate([R1 @ plane, -R2], axis=2).reshape(-1, 5)
    b = (p2 - p1 - R1 @ in_parent).reshape(-1)
    offset = np.linalg.lstsq(A, b, rcond=None)[0][:2]
    return float(np.linalg.norm(offset))


def cluster_poses(
    markers: Float[np.ndarray, "frames markers 3"],
) -> tuple[Float[np.ndarray, "frames 3 3"], Float[np.ndarray, "frames 3"]]:
    """Rotation and origin of a cluster in each frame, against its mean shape."""
    middle = markers.mean(axis=1)
    centred = markers - middle[:, None]
    shape = centred[0]
    for _ in range(2):
        R = nearest_rotation(np.einsum("tmi,mj->tij", centred, shape))
        shape = np.einsum("tji,tmj->mi", R, centred) / len(centred)
    return nearest_rotation(np.einsum("tmi,mj->tij", centred, shape)), middle


def _columns(fit: Fit, bodies: Sequence[str]) -> list[int]:
    """Of the recording's labels, those that the fit has on these bodies."""
    assert fit.groundwork is not None
    match = fit.groundwork.match
    body = {m.name: fit.skeleton.bodies[m.body].name for m in fit.skeleton.markers}
    columns = match.columns(fit.trials[0].capture.markers)
    return [c for name, c in zip(match.model, columns, strict=True) if c is not None and body[name] in bodies]
