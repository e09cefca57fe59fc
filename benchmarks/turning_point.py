"""The point that two marker clusters turn about, against the point that a fit's two bodies turn about.

Where two fits put a joint's centre differently, the motion of the raw markers has a say. Clusters on both
sides of a joint have the poses R₁, p₁ and R₂, p₂ in each frame; R₁ c₁ + p₁ = R₂ c₂ + p₂ over all frames gives
c₁ and c₂ by least squares (the symmetrical centre of rotation estimation: Ehrig et al., J Biomech 2006; 39:
2798-2809). The same is done with the poses of a fit's bodies, since a knee that glides turns about another
point than its child's origin. Along the direction that the motion tells least of nothing is compared.

Soft tissue moves the point by centimetres, one marker more or less likewise, and noise of the poses draws it
towards the clusters where the joint turns little: it says something where fits lie several centimetres apart.
At the ankle it is a compromise with the subtalar joint.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from benchmarks.leg_joints import Poses

FEWEST_FRAMES = 20
MOST_FRAMES = 400  # more tell nothing new
INDEPENDENT_S = 0.1  # errors of markers last so long
LARGEST_ERROR_M = 0.01  # standard error by white noise alone, from which on a point says nothing
LEAST_TURN_RAD = np.radians(5)  # RMS about the directions that count
UNTOLD = 1e-6  # of the largest information; a direction with less is left as it is


@dataclass(frozen=True)
class TurningPoint:
    """Where two bodies that share a joint hold together best."""

    in_parent: Float[np.ndarray, "3"]  # [m] in the frame of the body before the joint
    information: Float[np.ndarray, "3 3"]  # of that place, a frame's mean, in the same frame
    residual_m: float  # RMS of how far the two bodies' points lie apart, along an axis

    @property
    def across(self) -> Float[np.ndarray, "3 2"]:
        """The two directions that the motion tells most of."""
        return np.linalg.eigh(self.information)[1][:, 1:]

    def error_m(self, independent: float) -> float:
        """Standard error across the direction told least, if errors were white [m].

        Args:
            independent: number of frames with errors of their own.

        Returns:
            Infinite where the bodies turn by less than five degrees against each other.
        """
        told = np.linalg.eigvalsh(self.information)[1]
        if told < LEAST_TURN_RAD**2:
            return float("inf")
        return float(self.residual_m / np.sqrt(told * independent))


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


@dataclass(frozen=True)
class Jointed:
    """Two bodies of a fit and the centre of the joint between them, over all frames."""

    parent: Poses
    child: Poses
    centre_ground: Float[np.ndarray, "frames 3"]  # [m]


def off_measured(clusters: tuple[Poses, Poses], bodies: Sequence[Jointed], rate: float) -> list[float] | None:
    """How far the turning points of bodies lie from that of the clusters that they are to follow [m].

    Args:
        clusters: before and behind the joint; NaN on frames that do not show them.
        bodies: as several fits have them, on the same frames.
        rate: [Hz].

    Returns:
        A distance for each, across the direction told least; None where too few frames show both clusters, or
        they turned too little against each other.
    """
    shown = np.flatnonzero(np.isfinite(clusters[0][1] + clusters[1][1]).all(axis=1))
    if len(shown) < FEWEST_FRAMES:
        return None
    chosen = shown[:: -(-len(shown) // MOST_FRAMES)]
    parent, child = ((R[chosen], p[chosen]) for R, p in clusters)
    measured = turning_point(parent, child, np.zeros(3))
    if measured.error_m(min(len(chosen), len(shown) / (INDEPENDENT_S * rate))) > LARGEST_ERROR_M:
        return None
    found = []
    for body in bodies:
        own_parent, own_child = ((R[chosen], p[chosen]) for R, p in (body.parent, body.child))
        near = _local(own_parent, body.centre_ground[chosen]).mean(axis=0)
        own = turning_point(own_parent, own_child, near)
        own_ground = own_parent[1] + own_parent[0] @ own.in_parent
        apart = np.median(_local(parent, own_ground), axis=0) - measured.in_parent
        found.append(float(np.linalg.norm(apart @ measured.across)))
    return found


def _local(poses: Poses, points_ground: Float[np.ndarray, "frames 3"]) -> Float[np.ndarray, "frames 3"]:
    return np.einsum("tji,tj->ti", poses[0], points_ground - poses[1])
