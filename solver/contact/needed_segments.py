"""Which segments have to be seen for what. One is seen where a marker on it, or beyond it, ever is.

- A pose: pelvis and legs, pelvis and trunk, or legs and trunk, on one frame (`kinematics/determined.py`).
- Angles, torques and powers of a joint: its segment. Else the model keeps a neutral angle, reported nowhere.
- Forces given to feet: one leg. A height told from lengths, and a mass told from that height: likewise.
- Predicted ground forces, and torques from these: both legs, of somebody whom the feet carry.
"""

from collections.abc import Collection, Sequence

import numpy as np
from jaxtyping import Float

from solver.common.errors import ModelError
from solver.contact.sole import ANKLE_REACH_M, independent_feet, soles
from solver.kinematics.scale_prior import LEG_LENGTH_FRACTION, stature
from solver.kinematics.unseen_bodies import undetermined_dofs
from solver.skeleton.forward import body_poses
from solver.skeleton.skeleton import Skeleton

UPRIGHT = 0.8  # of the leg's length: hips above the ankles; 0.97 to 1.06 in 13 static trials, half in a chair
RARELY_UPRIGHT_SHARE = 0.05  # of the frames: who is upright no oftener sits, kneels or lies
BESIDE_FEET_M = 0.1  # from every sole to below the centre of mass: something else carries; squatting, 0
MOSTLY_SEEN_SHARE = 0.5  # of the frames


def unseen_coordinates(
    skeleton: Skeleton, observed_ground: Float[np.ndarray, "frames markers 3"]
) -> tuple[str, ...]:
    """Coordinates of joints beyond which no marker is ever seen.

    Args:
        skeleton: its markers are those of `observed_ground`, in the same order.
        observed_ground: NaN where unseen [m].
    """
    untold = undetermined_dofs(skeleton, observed_ground)
    return tuple(name for name, is_untold in zip(skeleton.dofs, untold, strict=True) if is_untold)


def seen_legs(skeleton: Skeleton, unseen: Collection[str], foot_bodies: Sequence[str]) -> tuple[str, ...]:
    """The feet of legs whose hips and knees are seen; ankles need not be.

    Raises:
        ModelError: a foot is no body of the model.
    """
    origins = body_poses(skeleton, skeleton.default_q[None])[1][0]
    feet = []
    for foot in independent_feet(skeleton, foot_bodies):
        sole = body = skeleton.body_index(foot)
        moving: set[str | None] = set()
        while skeleton.joints[body].parent >= 0:
            if np.linalg.norm(origins[body] - origins[sole]) > ANKLE_REACH_M:
                moving |= {axis.coordinate for axis in skeleton.joints[body].axes}
            body = skeleton.joints[body].parent
        if not moving & set(unseen):
            feet.append(foot)
    return tuple(feet)


def why_not_predicted(
    skeleton: Skeleton,
    q: Float[np.ndarray, "frames dofs"],
    unseen: Collection[str],
    foot_bodies: Sequence[str],
    com_ground: Float[np.ndarray, "frames 3"],
) -> str:
    """Why ground forces cannot be told from this motion; empty where they can.

    Args:
        skeleton: scaled.
        q: poses, all of which are known.
        unseen: coordinates that no marker shows.
        foot_bodies: of the subject.
        com_ground: centre of mass [m].
    """
    try:
        feet = independent_feet(skeleton, foot_bodies)
        outlines = soles(skeleton, feet)
        seen = seen_legs(skeleton, unseen, feet)
    except ModelError as error:
        return str(error)
    unseen_feet = [foot for foot in feet if foot not in seen]
    if unseen_feet:
        legs = "a leg is not seen" if len(unseen_feet) == 1 else "legs are not seen"
        return (
            f"{legs} ({', '.join(unseen_feet)}: no marker from the knee down), and predicted forces need both"
        )
    upright = hips_over_ankles(skeleton, q)
    if upright is None or (upright > UPRIGHT).mean() > RARELY_UPRIGHT_SHARE:
        return ""
    R, p = body_poses(skeleton, q)
    below = com_ground.copy()
    below[:, 1] = np.min([sole.corners_ground(R, p)[..., 1].min(axis=1) for sole in outlines], axis=0)
    beside = np.min([sole.distance(R, p, below) for sole in outlines], axis=0) > BESIDE_FEET_M
    if beside.mean() < MOSTLY_SEEN_SHARE:
        return ""
    return (
        "the person sits, kneels or lies (hips below standing height, centre of mass beside the feet), and "
        "something else than the feet carries the body"
    )


def hips_over_ankles(
    skeleton: Skeleton, q: Float[np.ndarray, "frames dofs"]
) -> Float[np.ndarray, " frames"] | None:
    """Height of the hips above the lower ankle over the leg's length; None without legs of usual names."""
    height, names = stature(skeleton), skeleton.body_names
    if height is None:
        return None
    up = body_poses(skeleton, q)[1][..., 1]
    hips = [i for i, name in enumerate(names) if name in ("femur_r", "femur_l")]
    ankles = [i for i, name in enumerate(names) if name.startswith(("talus_", "calcn_", "foot_"))]
    return (up[:, hips].mean(axis=1) - up[:, ankles].min(axis=1)) / (LEG_LENGTH_FRACTION * height)
