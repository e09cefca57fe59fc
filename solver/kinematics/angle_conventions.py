"""Joint angles as gait laboratories give them, from the poses of the fitted segments.

`cgm`: output angles of the conventional gait model, Plug-in Gait's. Sources: Davis et al. 1991
(10.1016/0167-9457(91)90046-Z), Kadaba et al. 1990 (10.1002/jor.1100080310).

`isb`: joint coordinate systems of Grood and Suntay 1983 (10.1115/1.3138397), as the ISB recommends them: Wu
et al. 2002 (10.1016/S0021-9290(01)00222-6), Wu et al. 2005 (10.1016/j.jbiomech.2004.05.042). The pelvis by
rotation, obliquity and tilt: Baker 2001 (10.1016/S0966-6362(00)00083-7).

A segment's axes are x ahead, y up and z to the right, as the ISB has them: those of the ground in the model's
neutral pose (all coordinates zero), whatever axes the model's file gives its bodies. Orders are of intrinsic
rotations that take the parent's axes to the child's. ZXY turns about the parent's z (flexion), then about the
floating axis, then about the child's y: the coordinate system of Grood and Suntay. (Plug-in Gait has y to the
left and z up, and writes that order YXZ.) Bony axes are not known to a fit: its angles have offsets, which
the documentation lists.
"""

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from solver.skeleton.forward import body_poses
from solver.skeleton.functions import Constant
from solver.skeleton.skeleton import Skeleton

Convention = Literal["cgm", "isb"]
CONVENTIONS: tuple[Convention, ...] = ("cgm", "isb")
SIDES = ("r", "l")
MIRROR = np.diag([1.0, 1.0, -1.0])
LAB = (
    "laboratory"  # in place of a parent: axes of which x is the laboratory's axis nearest to the progression
)
LEAST_WAY_M = 1.0  # of the pelvis; with less, on a treadmill or standing, it is where it faces


@dataclass(frozen=True)
class Angle:
    """One of the three angles of an order."""

    name: str
    place: int  # in the order
    sign: int


@dataclass(frozen=True)
class Rotations:
    """How one body turns in another, on the right side; the left side is its mirror image.

    "_s" at the end of a body's name stands for the side.
    """

    name: str
    parent: str
    child: str
    order: str
    angles: tuple[Angle, ...]
    both_sides: bool = True


FLEXION, ADDUCTION, ROTATION = (Angle("flexion", 0, 1), Angle("adduction", 1, 1), Angle("rotation", 2, 1))
HIP = Rotations(
    "hip", "pelvis", "femur_s", "ZXY", (FLEXION, ADDUCTION, ROTATION)
)  # internal rotation positive
KNEE = Rotations(  # flexion, adduction (varus) and internal rotation of the shank positive
    "knee", "femur_s", "tibia_s", "ZXY", (Angle("flexion", 0, -1), ADDUCTION, ROTATION)
)
DORSIFLEXION = Angle("dorsiflexion", 0, 1)
TABLES: dict[Convention, tuple[Rotations, ...]] = {
    "cgm": (
        Rotations(  # front down, this side up, this side ahead are positive
            "pelvis",
            LAB,
            "pelvis",
            "ZXY",
            (Angle("tilt", 0, -1), Angle("obliquity", 1, -1), Angle("rotation", 2, 1)),
        ),
        HIP,
        KNEE,
        # That model's foot is a line from heel to toe, which turns about the shank's z, then y: toes up, then
        # in. An angle about the line itself is not measured.
        Rotations("ankle", "tibia_s", "calcn_s", "ZYX", (DORSIFLEXION, Angle("rotation", 1, 1))),
        Rotations(  # as the pelvis
            "thorax",
            LAB,
            "torso",
            "ZXY",
            (Angle("tilt", 0, -1), Angle("obliquity", 1, -1), Angle("rotation", 2, 1)),
        ),
        Rotations(  # thorax in the pelvis: bent forward, to this side, this side turned back are positive
            "spine",
            "pelvis",
            "torso",
            "ZXY",
            (Angle("flexion", 0, -1), Angle("bending", 1, 1), Angle("rotation", 2, -1)),
        ),
        Rotations("shoulder", "torso", "humerus_s", "ZXY", (FLEXION, Angle("abduction", 1, -1), ROTATION)),
        Rotations("elbow", "humerus_s", "ulna_s", "ZXY", (FLEXION,)),
    ),
    "isb": (
        Rotations(  # first about the vertical, so that a turn leaves tilt and obliquity alone; signs as above
            "pelvis",
            LAB,
            "pelvis",
            "YXZ",
            (Angle("tilt", 2, -1), Angle("obliquity", 1, -1), Angle("rotation", 0, 1)),
        ),
        HIP,
        KNEE,
        Rotations(
            "ankle",
            "tibia_s",
            "calcn_s",
            "ZXY",
            (DORSIFLEXION, Angle("inversion", 1, 1), Angle("rotation", 2, 1)),
        ),
        Rotations(  # Wu 2005's signs: extension, bending to the right, turning to the left
            "trunk",
            "pelvis",
            "torso",
            "ZXY",
            (Angle("extension", 0, 1), Angle("bending", 1, 1), Angle("rotation", 2, 1)),
            both_sides=False,
        ),
        # plane of elevation (0: abduction, 90: flexion), elevation, internal rotation; of a hanging arm only
        # the sum of first and last means something
        Rotations(
            "shoulder",
            "torso",
            "humerus_s",
            "YXY",
            (Angle("plane", 0, 1), Angle("elevation", 1, -1), Angle("rotation", 2, 1)),
        ),
        Rotations(
            "elbow",
            "humerus_s",
            "radius_s",
            "ZXY",
            (FLEXION, Angle("carrying", 1, 1), Angle("pronation", 2, 1)),
        ),
    ),
}


def angles_by_convention(
    skeleton: Skeleton, q: Float[np.ndarray, "frames dofs"], convention: Convention
) -> dict[str, Float[np.ndarray, " frames"]]:
    """Angles [°] by name with their side, as in "hip_flexion_r"; NaN where a segment's pose is not known.

    What the model lacks the bodies for is left out, and so are second and third angles across a hinge.

    Args:
        skeleton: fitted.
        q: of its free coordinates [rad or m]; NaN where unknown.
        convention: whose.
    """
    R, p = body_poses(skeleton, q)
    neutral, _ = body_poses(skeleton, np.zeros((1, q.shape[1])))
    names = skeleton.body_names
    R_ground = {name: R[:, k] @ neutral[0, k].T for k, name in enumerate(names)}
    if "pelvis" in names:
        at = p[:, names.index("pelvis")]
        R_ground[LAB] = np.broadcast_to(_progression(R_ground["pelvis"], at), (len(q), 3, 3))
    found: dict[str, Float[np.ndarray, " frames"]] = {}
    for rotations in TABLES[convention]:
        for side in SIDES[: 2 if rotations.both_sides else 1]:
            parent, child = (_of_side(name, side) for name in (rotations.parent, rotations.child))
            if parent not in R_ground or child not in R_ground:
                continue
            R_parent_child = np.swapaxes(R_ground[parent], 1, 2) @ R_ground[child]
            if side == "l":
                R_parent_child = MIRROR @ R_parent_child @ MIRROR
            euler = _euler(R_parent_child, rotations.order)
            hinge = parent != LAB and _axes_between(skeleton, parent, child) < 2
            for angle in rotations.angles[: 1 if hinge else None]:
                name = f"{rotations.name}_{angle.name}" + (f"_{side}" if rotations.both_sides else "")
                found[name] = angle.sign * euler[:, angle.place]
    return found


def _of_side(name: str, side: str) -> str:
    return f"{name[:-1]}{side}" if name.endswith("_s") else name


def _euler(R: Float[np.ndarray, "frames 3 3"], order: str) -> Float[np.ndarray, "frames 3"]:
    """Intrinsic rotations [°] of an order; NaN where R is not known."""
    known = np.isfinite(R).all(axis=(1, 2))
    angles = np.full((len(R), 3), np.nan)
    if known.any():
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # first and last angle not told apart: the last is 0
            angles[known] = Rotation.from_matrix(R[known]).as_euler(order, degrees=True)
    if order[0] == order[2]:  # of the two ways to turn so, the one whose second angle is negative
        angles = np.stack([angles[:, 0] % 360 - 180, -angles[:, 1], angles[:, 2] % 360 - 180], axis=1)
    return angles


def _progression(
    R_ground_pelvis: Float[np.ndarray, "frames 3 3"], pelvis_ground: Float[np.ndarray, "frames 3"]
) -> Float[np.ndarray, "3 3"]:
    """R_ground_laboratory: x is the horizontal axis of the ground nearest to where the pelvis goes."""
    known = np.flatnonzero(
        np.isfinite(R_ground_pelvis).all(axis=(1, 2)) & np.isfinite(pelvis_ground).all(axis=1)
    )
    if not len(known):
        return np.eye(3)
    way = pelvis_ground[known[-1]] - pelvis_ground[known[0]]
    if np.hypot(way[0], way[2]) < LEAST_WAY_M:
        way = R_ground_pelvis[known, :, 0].mean(axis=0)
    quarters = np.round(np.arctan2(-way[2], way[0]) / (np.pi / 2))
    return np.round(Rotation.from_euler("y", 90.0 * quarters, degrees=True).as_matrix())


def _axes_between(skeleton: Skeleton, parent: str, child: str) -> int:
    """About how many axes the child turns in the parent."""
    turning = {c.name for c in skeleton.free_coordinates if c.motion == "rotation"}
    return sum(
        axis.kind == "rotation" and axis.coordinate in turning and not isinstance(axis.function, Constant)
        for body in _chain(skeleton, parent, child)
        for axis in skeleton.joints[body].axes
    )


def _chain(skeleton: Skeleton, parent: str, child: str) -> Iterator[int]:
    """Bodies from the child up to below the parent; up to the root where that is no ancestor."""
    body, names = skeleton.body_names.index(child), skeleton.body_names
    while body >= 0 and names[body] != parent:
        yield body
        body = skeleton.joints[body].parent
