"""The external wrench in Cartesian terms: from generalized forces of the root joint to force and moment."""

import numpy as np
from jaxtyping import Float

from solver.kinematics.root_joint import RootJoint
from solver.skeleton.forward import Poses
from solver.skeleton.skeleton import Skeleton

NEARLY_SINGULAR = 1e-9  # relative singular value below which the root's angles say nothing about an axis


def root_wrench(
    root: RootJoint, poses: Poses, torques: Float[np.ndarray, "frames dofs"]
) -> Float[np.ndarray, "frames 6"]:
    """The wrench on the root body that the generalized forces of its joint amount to.

    The root's velocities q̇ make the twist S q̇, and equal power means τ = Sᵀ w. Everything hangs on the root,
    so w is the external wrench that the whole motion demands beyond the one given to inverse dynamics.
    Euler axes are neither orthogonal nor at the joint's centre: the three rotational τ are no Cartesian moment.

    Args:
        root: the free root joint.
        poses: at the frames of `torques`.
        torques: generalized forces of all dofs [N·m or N].

    Returns:
        Force [N] and moment about the ground origin [N·m], ground frame.
    """
    moving = np.flatnonzero(root.chain_body_mask)
    return moving
