"""The point that two marker clusters turn about, against the point that a fit's two bodies turn about.

Where two fits put a joint's centre differently, the motion of the raw markers has a say. Clusters on both
sides of a joint have the poses R₁, p₁ and R₂, p₂ in each frame; R₁ c₁ + p₁ = R₂ c₂ + p₂ over all frames gives
c₁ and c₂ by least squares (the symmetrical centre of rotation estimation: Ehrig et al., J Biomech 2006; 39:
2798-2809). The same is done with the poses of a fit's bodies, since a knee that glides turns about another
point than its child's origin. Along the direction that the motion tells least of nothing is compared.

The model's fit says which marker is on which body. Soft tissue moves the point by one or two centimetres.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from benchmarks.leg_joints import joint_centres
from benchmarks.rigid_clusters import FEWEST_MARKERS, cluster_poses
from solver.fit import Fit
from solver.markers.atlas import atlas
from solver.markers.understanding import understand
from solver.skeleton.forward import body_poses

SIDES = {"hip": ("pelvis", "femur"), "knee": ("femur", "tibia"), "ankle": ("tibia", "calcn")}
FEWEST_FRAMES = 20
MOST_FRAMES = 400  # more tell nothing new
INDEPENDENT_S = 0.1  # errors of markers last so long
LARGEST_ERROR_M = 0.01  # standard error of a point, from which on it says nothing
UNTOLD = 1e-6  # of the largest information; a direction with less is left as it is

Poses = tuple[Float[np.ndarray, "frames 3 3"], Float[np.ndarray, "frames 3"]]


@dataclass(frozen=True)
class TurningPoint:
    """Where two bodies that share a joint hold together best."""

    in_parent: Float[np.ndarray, "3"]  # [m] in the frame of the body before the joint
    information: Float[np.ndarray, "3 3"]  # of that place, a frame's mean, in the same frame
    residual_m: float  # RMS of how far the two bodies' points lie apart, along an axis

    def error_m(self, independent: float) -> float:
        """Standard error across the direction told least, with so many independent frames [m]."""
        told = np.linalg.eigvalsh(self.information)[1]
        return float(self.residual_m / np.sqrt(max(told, UNTOLD) * independent))


def turning_point(parent: Poses, child: Poses, near_in_parent: Float[np.ndarray, "3"]) -> TurningPoint:
    """The common point of two bodies; what the motion does not tell of it stays near a given place.

    Args:
        parent: rotation and origin of the body before the joint, in the ground frame.
        child: of the one behind it.
        near_in_parent: [m].
    """
    (R1, p1), (R2, p2) = parent, child
    frames = len(R1)
    # with the child's point eliminated: R₂ᵀ (R₁ c₁ + p₁ − p₂) is to stay the same
    A = R2.transpose(0, 2, 1) @ R1
    b = np.einsum("tji,tj->ti", R2, p1 - p2) + A @ near_in_parent
    A_varying, b_varying = A - A.mean(axis=0), b - b.mean(axis=0)
    information = np.einsum("tji,tjk->ik", A_varying, A_varying) / frames
    gradient = np.einsum("tji,tj->i", A_varying, b_varying) / frames
    offset = -np.linalg.pinv(information, rcond=UNTOLD, hermitian=True) @ gradient
    residual = b_varying + A_varying @ offset
    return TurningPoint(near_in_parent + offset, information, float(np.sqrt(np.mean(residual**2))))


def off_turning_point(fits: Sequence[Fit], clusters_of: Fit, joint: str, side: str) -> list[float] | None:
    """How far the fits' turning points lie from that of the raw markers [m].

    Args:
        fits: of one recording.
        clusters_of: the one whose model says which marker is on which body.
        joint: "hip", "knee" or "ankle".
        side: "r" or "l".

    Returns:
        A distance for each fit, across the direction told least; None where fewer than three markers are on
        either body, too few frames show them, or the joint turned too little.
    """
    bodies = [name if name == "pelvis" else f"{name}_{side}" for name in SIDES[joint]]
    markers = clusters_of.trials[0].capture.markers
    clusters = [raw_columns(clusters_of, body) for body in bodies]
    if min(len(c) for c in clusters) < FEWEST_MARKERS:
        return None
    poses = [cluster_poses(markers.positions_ground[:, c]) for c in clusters]
    seen = np.flatnonzero(_seen(poses[0]) & _seen(poses[1]))
    if len(seen) < FEWEST_FRAMES:
        return None
    chosen = seen[:: -(-len(seen) // MOST_FRAMES)]
    parent, child = ((R[chosen], p[chosen]) for R, p in poses)
    measured = turning_point(parent, child, np.zeros(3))
    if measured.error_m(len(seen) / (INDEPENDENT_S * markers.rate)) > LARGEST_ERROR_M:
        return None
    across = np.linalg.eigh(measured.information)[1][:, 1:]
    points = [_in_cluster(fit, joint, side, chosen, parent) for fit in fits]
    return [float(np.linalg.norm((point - measured.in_parent) @ across)) for point in points]


def _in_cluster(
    fit: Fit, joint: str, side: str, chosen: Int[np.ndarray, " frames"], cluster: Poses
) -> Float[np.ndarray, "3"]:
    """A fit's turning point in the frame of the cluster before the joint [m]: the median over frames."""
    R, p = body_poses(fit.skeleton, fit.trials[0].motion.q[chosen])
    index = fit.skeleton.body_index
    before, behind = SIDES[joint]
    i = index(before if before == "pelvis" else f"{before}_{side}")
    k = index(f"{behind}_{side}")
    centre = joint_centres(fit, side)[joint][chosen]
    near = np.einsum("tji,tj->ti", R[:, i], centre - p[:, i]).mean(axis=0)
    own = turning_point((R[:, i], p[:, i]), (R[:, k], p[:, k]), near)
    own_ground = p[:, i] + R[:, i] @ own.in_parent
    return np.median(np.einsum("tji,tj->ti", cluster[0], own_ground - cluster[1]), axis=0)


def _seen(poses: Poses) -> Bool[np.ndarray, " frames"]:
    return np.isfinite(poses[1]).all(axis=1)


def raw_columns(fit: Fit, body_name: str) -> list[int]:
    """Columns of the recording's labels that the fit has on a body; computed joint centres left out."""
    assert fit.groundwork is not None
    match, markers = fit.groundwork.match, fit.trials[0].capture.markers
    body = {m.name: fit.skeleton.bodies[m.body].name for m in fit.skeleton.markers}
    computed = {
        row.label
        for row in understand(list(markers.names), [markers]).labels
        if row.landmark is not None and atlas()[row.landmark].kind == "centre"
    }
    return [
        c
        for name, c in zip(match.model, match.columns(markers), strict=True)
        if c is not None and body[name] == body_name and markers.names[c] not in computed
    ]
