"""Moving the whole body so that its centre of mass follows a given trajectory."""

import numpy as np
from jaxtyping import Float

from solver.dynamics.root_wrench import centre_of_mass_of
from solver.kinematics.root_joint import root_joint
from solver.skeleton.skeleton import Skeleton


def with_com_at(
    skeleton: Skeleton, q: Float[np.ndarray, "frames dofs"], com_ground: Float[np.ndarray, "frames 3"]
) -> Float[np.ndarray, "frames dofs"]:
    """The same postures with the root moved until the centre of mass is there; no angle changes.

    Args:
        skeleton: scaled.
        q: generalized coordinates [rad or m].
        com_ground: where the centre of mass is to be [m].

    Returns:
        Generalized coordinates; only the root's three translations differ.

    Raises:
        ModelError: the skeleton's root is not free to move in all six ways.
    """
    root = root_joint(skeleton)
    shift_ground = com_ground - centre_of_mass_of(skeleton, q)
    shift_parent = shift_ground @ root.joint.R_parent_frame
    axes = np.array([a.axis / np.linalg.norm(a.axis) for a in root.translations])
    metres_per_unit = np.array([np.diff(a.function(np.array([0.0, 1.0]))[0])[0] for a in root.translations])
    moved = q.copy()
    moved[:, root.translation_dofs] += np.linalg.solve(axes.T, shift_parent.T).T / metres_per_unit
    return moved
