"""What the motion demands of feet whose force is missing, and where on the floor it would act."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from solver.dynamics.missing_wrench import inferred_wrenches
from solver.fit import TrialFit
from solver.skeleton.forward import body_poses
from solver.skeleton.skeleton import Skeleton

FARTHEST_M = 0.25  # [m] from the foot's origin: about a foot's length; farther, the arrow starts at the foot
SMALLEST_N = 20.0  # [N] upwards; below it the centre of pressure is noise


@dataclass(frozen=True)
class DemandedForce:
    """Of one foot; NaN on frames on which its force was measured and counts."""

    foot: str
    force: Float[np.ndarray, "frames 3"]  # [N]
    point: Float[np.ndarray, "frames 3"]  # [m] on the floor


def demanded_forces(
    trial: TrialFit,
    skeleton: Skeleton,
    at_frames: Callable[[Float[np.ndarray, "rows 3"]], Float[np.ndarray, "frames 3"]],
) -> tuple[DemandedForce, ...]:
    """The forces of all feet that miss one on some frame; none without dynamics.

    Args:
        trial: fitted.
        skeleton: of the fit.
        at_frames: from the fit's rows to the recording's frames.
    """
    if trial.dynamics is None or trial.contacts is None or trial.mask is None or trial.mask.counts.all():
        return ()
    wrenches = trial.dynamics.wrench_foretold_ground
    if wrenches is None:  # a fit that kept none
        wrenches = inferred_wrenches(skeleton, trial.dynamics, trial.contacts, trial.mask)
    p_ground_body = body_poses(skeleton, trial.motion.q)[1]
    found = []
    for i, foot in enumerate(trial.contacts.foot_bodies):
        counts = trial.mask.counts[:, i]
        if counts.all():
            continue
        force = wrenches[:, i, :3].copy()
        point = acting_point(wrenches[:, i], p_ground_body[:, skeleton.body_index(foot)])
        force[counts] = np.nan
        found.append(DemandedForce(foot, at_frames(force), at_frames(point)))
    return tuple(found)


def acting_point(
    wrench_ground: Float[np.ndarray, "frames 6"], foot_ground: Float[np.ndarray, "frames 3"]
) -> Float[np.ndarray, "frames 3"]:
    """Where on the floor the wrench has no horizontal moment [m], if that is near the foot; else below it.

    Args:
        wrench_ground: force [N] and moment about the ground origin [N·m].
        foot_ground: the foot's origin [m].
    """
    up = wrench_ground[:, 1]
    loaded = up >= SMALLEST_N
    safe = np.where(loaded, up, 1.0)
    point = np.stack([wrench_ground[:, 5] / safe, np.zeros(len(up)), -wrench_ground[:, 3] / safe], axis=1)
    under_foot = foot_ground * [1.0, 0.0, 1.0]
    near = loaded & (np.linalg.norm(point - under_foot, axis=1) <= FARTHEST_M)
    return np.where(near[:, None], point, under_foot)
