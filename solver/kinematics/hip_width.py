"""How far apart the hips are: a parameter of its own, and what two regressions expect of it.

The width of a pelvis across its spines tells the distance of the hips to a centimetre or so, and models
disagree about it. One factor for both would let the spines' markers decide where the legs turn.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from solver.capture.capture import Markers
from solver.kinematics.marker_matching import MarkerMatch
from solver.skeleton.scaling import stretched_bone
from solver.skeleton.skeleton import Skeleton

STRAIGHT = 0.98  # spine to malleolus over the way by the knee, from which on a leg counts as straight
LEG_LANDMARKS = tuple(
    f"{mark}_{side}" for side in "rl" for mark in ("knee_lateral", "ankle_lateral", "ankle_medial")
)
_THIGH = re.compile(r"femur|thigh|upper_?leg", re.IGNORECASE)


@dataclass(frozen=True)
class HipPair:
    """The two hip joints of a model, on one pelvis."""

    right: int  # body behind the joint
    left: int
    pelvis: int
    axis: int  # of the pelvis' frame, along which the hips are apart

    def width(self, skeleton: Skeleton) -> float:
        """Distance of the hip centres along the axis [m]."""
        right, left = (skeleton.joints[body].p_parent_frame[self.axis] for body in (self.right, self.left))
        return float(abs(right - left))

    def arm(self, skeleton: Skeleton, body: int) -> Float[np.ndarray, "3"]:
        """From the middle of the hips to that of `body`, in the pelvis' frame, along the axis [m]."""
        places = [skeleton.joints[side].p_parent_frame[self.axis] for side in (self.right, self.left)]
        arm = np.zeros(3)
        arm[self.axis] = skeleton.joints[body].p_parent_frame[self.axis] - np.mean(places)
        return arm

    def widened(self, skeleton: Skeleton, ratio: float) -> Skeleton:
        """The skeleton with hips and the pelvis' bone `ratio` times as wide; its markers and mass stay."""
        joints, bodies = list(skeleton.joints), list(skeleton.bodies)
        bodies[self.pelvis] = stretched_bone(bodies[self.pelvis], np.where(np.eye(3)[self.axis], ratio, 1.0))
        for body in (self.right, self.left):
            arm = self.arm(skeleton, body)
            joints[body] = replace(
                joints[body], p_parent_frame=joints[body].p_parent_frame + (ratio - 1) * arm
            )
        return replace(skeleton, joints=tuple(joints), bodies=tuple(bodies))


def hip_pair(skeleton: Skeleton) -> HipPair | None:
    """The hips of a model; None where it has not two thighs on one pelvis, one to each side."""
    thighs = [i for i, body in enumerate(skeleton.bodies) if _THIGH.search(body.name)]
    parents = {skeleton.joints[body].parent for body in thighs}
    if len(thighs) != 2 or len(parents) != 1 or (pelvis := parents.pop()) < 0:
        return None
    first, second = (skeleton.joints[body].p_parent_frame for body in thighs)
    axis = int(np.argmax(np.abs(first - second)))
    if first[axis] * second[axis] >= 0:
        return None
    right, left = thighs if first[axis] > second[axis] else thighs[::-1]
    return HipPair(right, left, pelvis, axis)


def expected_hip_width(
    landmarks: Mapping[str, str], match: MarkerMatch, recordings: Sequence[Markers]
) -> float | None:
    """Distance of the hip centres [m] by regression; None where no recording shows what it takes.

    The mean of two that rest on different measures: from the width between the anterior spines (Harrington et
    al. 2007, J Biomech 40: 595-602), and from the length of the straight leg, anterior spine to medial
    malleolus (Hara et al. 2016, Sci Rep 6: 37707).

    Args:
        landmarks: the model's marker at each landmark that is known.
        match: which label is which marker.
        recordings: of one subject.
    """
    seen = np.concatenate([match.observed(r) for r in recordings])
    x = {mark: seen[:, match.model.index(name)] for mark, name in landmarks.items() if name in match.model}
    expected = []
    if {"asis_r", "asis_l"} <= x.keys():
        expected.append(2 * (0.33 * _median(_apart(x["asis_r"], x["asis_l"])) + 0.0073))
    legs = [leg for side in "rl" if (leg := _leg_length(x, side)) is not None]
    if legs:
        expected.append(2 * (0.086 * float(np.mean(legs)) + 0.008))
    expected = [width for width in expected if np.isfinite(width)]
    return float(np.mean(expected)) if expected else None


def _leg_length(x: Mapping[str, Float[np.ndarray, "frames 3"]], side: str) -> float | None:
    """Anterior spine to medial malleolus where the leg is straight [m]."""
    names = [f"{mark}_{side}" for mark in ("asis", "knee_lateral", "ankle_lateral", "ankle_medial")]
    if not all(name in x for name in names):
        return None
    spine, knee, outer, inner = (x[name] for name in names)
    with np.errstate(invalid="ignore"):
        straight = _apart(spine, outer) > STRAIGHT * (_apart(spine, knee) + _apart(knee, outer))
    length = _median(_apart(spine, inner)[straight])
    return length if np.isfinite(length) else None


def _apart(
    one: Float[np.ndarray, "frames 3"], other: Float[np.ndarray, "frames 3"]
) -> Float[np.ndarray, " frames"]:
    return np.linalg.norm(one - other, axis=1)


def _median(values: Float[np.ndarray, " frames"]) -> float:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else float("nan")
