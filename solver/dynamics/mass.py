"""The subject's mass from what the plates carried, where nobody entered one."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from solver.contact.wrenches import ContactWrenches
from solver.kinematics.motion import Motion
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.skeleton import Skeleton

WELL_LOADED_M_S2 = 2.0  # support acceleration above which the ratio of force to acceleration means something
FULLY_MEASURED_WITHIN = 0.2  # of the upper end; frames below it miss a foot's force


def mass_from_forces(
    skeleton: Skeleton, motions: Sequence[Motion], contacts: Sequence[ContactWrenches]
) -> float | None:
    """Vertical force over vertical support acceleration, the median of the frames that carry the whole body.

    The centre of mass' acceleration depends on the shares of the segments' masses only. A step beside the
    plates makes a frame's ratio too small, never too large, so frames well below the upper end don't count.

    Args:
        skeleton: scaled.
        motions: of the trials, low-passed as the forces were.
        contacts: of the same trials.

    Returns:
        Mass [kg]; None when no frame carried load.
    """
    ratios = np.concatenate(
        [_ratios(skeleton, m, c) for m, c in zip(motions, contacts, strict=True)] or [np.empty(0)]
    )
    if not len(ratios):
        return None
    upper = np.quantile(ratios, 0.9)
    return float(np.median(ratios[ratios > (1 - FULLY_MEASURED_WITHIN) * upper]))


def _ratios(skeleton: Skeleton, motion: Motion, contacts: ContactWrenches) -> Float[np.ndarray, " some"]:
    model = RigidBodyModel(skeleton)
    acceleration = model.centre_of_mass_acceleration(motion.q, motion.velocity, motion.acceleration)
    up = -skeleton.gravity / np.linalg.norm(skeleton.gravity)
    support = (acceleration - skeleton.gravity) @ up
    force = contacts.wrench_ground[:, :, :3].sum(axis=1) @ up
    well = contacts.observed & contacts.in_contact.any(axis=1) & (support > WELL_LOADED_M_S2)
    return force[well] / support[well]
