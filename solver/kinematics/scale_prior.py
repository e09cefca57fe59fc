"""What is known before any marker is seen: how segments scale together, and how far markers may lie off.

And how marker positions change with the scale factors, at fixed joint angles.
"""

import re
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from solver.kinematics.hip_width import HipPair, hip_pair
from solver.kinematics.settings import CLUSTER_OFFSET_STD_M
from solver.skeleton.forward import ForwardKinematics, Poses
from solver.skeleton.functions import Linear
from solver.skeleton.scaling import scaled
from solver.skeleton.segment_tables import lengths
from solver.skeleton.skeleton import Marker, Skeleton

BONY_OFFSET_STD_M = 0.012  # [m] palpation repeats within 5-10 mm, the skin adds some (Della Croce 2005)
OTHER_OFFSET_STD_M = 0.02  # [m] markers that are neither bony landmarks nor clusters
SEGMENT_SCALE_STD = 0.06  # [log] segment lengths against body size (Drillis 1964)
ASPECT_SCALE_STD = 0.05  # [log] width and depth of a segment against its length

LEG_LENGTH_FRACTION = 0.491  # hip to ankle over stature: thigh 0.245, shank 0.246 (Drillis & Contini 1966)

# Words for tracking markers, and the usual codes: RTH1, LTB2, RTIB, RTHI, RTIAP, R.SH3, RUA1, RSK.
_CLUSTER = re.compile(
    r"thigh|shank|shin|cluster|biceps|forearm|upper_?arm|wand"
    r"|^[rl]?[._ ]?(?:(?:thi?|tib?|tb|sk|ua|fa)(?:\d+|[apl][pdt]|lat)?|sh\d+)$",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class ScaleGroups:
    """Bodies that share scale factors: left and right counterparts. The hips' distance has one of its own."""

    group: Int[np.ndarray, " bodies"]
    names: tuple[str, ...]
    hips: HipPair | None = None

    @property
    def count(self) -> int:
        """Number of groups."""
        return len(self.names)

    @property
    def size(self) -> int:
        """Number of log factors: three a group, and last that of the hips' distance, where there is one."""
        return 3 * self.count + (self.hips is not None)

    def axes(self, log_scale: Float[np.ndarray, " parameters"]) -> Float[np.ndarray, "groups 3"]:
        """Scale factors of every group along its axes."""
        return np.exp(log_scale[: 3 * self.count].reshape(self.count, 3))

    def factors(self, log_scale: Float[np.ndarray, " parameters"]) -> Float[np.ndarray, "bodies 3"]:
        """Scale factors of every body from the groups' log factors."""
        return self.axes(log_scale)[self.group]

    def resized(
        self, skeleton: Skeleton, log_scale: Float[np.ndarray, " parameters"], mass_kg: float | None = None
    ) -> Skeleton:
        """The unscaled skeleton at these log factors; with `mass_kg`, of that mass [kg]."""
        sized = scaled(skeleton, self.factors(log_scale), mass_kg)
        return sized if self.hips is None else self.hips.widened(sized, float(np.exp(log_scale[-1])))


def scale_groups(skeleton: Skeleton) -> ScaleGroups:
    """One group per body, counterparts (`femur_r`, `femur_l`) together."""
    names: list[str] = []
    group = []
    for body in skeleton.body_names:
        stem = without_side(body)
        if stem not in names:
            names.append(stem)
        group.append(names.index(stem))
    return ScaleGroups(np.array(group), tuple(names), hip_pair(skeleton))


def without_side(name: str) -> str:
    """`femur_r` and `r_femur` and `femur_right` become `femur`."""
    return re.sub(r"(_r|_l|_right|_left)$|^(r_|l_|right_|left_)", "", name)


@dataclass(frozen=True)
class LogScalePrior:
    """Gaussian prior of the log factors."""

    mean: Float[np.ndarray, " n"]
    precision: Float[np.ndarray, "n n"]

    def with_hip_width(self, groups: ScaleGroups, log_ratio: float, std: float) -> "LogScalePrior":
        """And the hips' distance, over the unscaled model's, is known besides.

        Args:
            groups: with hips.
            log_ratio: expected logarithm of the ratio.
            std: of that logarithm.
        """
        if groups.hips is None:
            return self
        together = np.zeros(groups.size)  # the pelvis' factor and the hips' own multiply
        together[[3 * groups.group[groups.hips.pelvis] + groups.hips.axis, -1]] = 1.0
        precision = self.precision + np.outer(together, together) / std**2
        mean = np.linalg.solve(precision, self.precision @ self.mean + together * log_ratio / std**2)
        return LogScalePrior(mean, precision)


def log_scale_precision(groups: ScaleGroups, size_std: float, *, hips_std: float) -> Float[np.ndarray, "n n"]:
    """Inverse covariance of the log factors: body size, plus segment, plus axis; hips by themselves.

    Args:
        groups: of bodies.
        size_std: of the whole body's log size.
        hips_std: of the log of the hips' distance against the pelvis' width.
    """
    count = 3 * groups.count
    segment = np.repeat(np.arange(groups.count), 3)
    covariance = np.full((count, count), size_std**2)
    covariance += SEGMENT_SCALE_STD**2 * (segment[:, None] == segment[None, :])
    covariance += ASPECT_SCALE_STD**2 * np.eye(count)
    precision = np.zeros((groups.size, groups.size))
    precision[:count, :count] = np.linalg.inv(covariance)
    if groups.hips is not None:
        precision[-1, -1] = hips_std**-2
    return precision


def offset_std(markers: tuple[Marker, ...]) -> Float[np.ndarray, " markers"]:
    """How far each marker may lie from the model's place for it [m].

    Where the marker itself does not say: the model's `fixed` flag marks bony landmarks where the file uses it
    at all; names tell clusters.
    """
    flags_used = any(m.fixed for m in markers)
    stds = []
    for marker in markers:
        if marker.spread_m is not None:
            stds.append(marker.spread_m)
        elif flags_used and marker.fixed:
            stds.append(BONY_OFFSET_STD_M)
        elif _CLUSTER.search(marker.name):
            stds.append(CLUSTER_OFFSET_STD_M)
        else:
            stds.append(OTHER_OFFSET_STD_M)
    return np.array(stds)


def stature(skeleton: Skeleton) -> float | None:
    """Standing height [m] from the leg: hip to knee to ankle over its share of stature.

    None where the model has no leg with the field's names (femur, tibia, talus or a foot).
    """
    names = skeleton.body_names
    legs = []
    for side in ("_r", "_l"):
        foot = next((f + side for f in ("talus", "calcn", "foot") if f + side in names), None)
        if "femur" + side not in names or "tibia" + side not in names or foot is None:
            continue
        kinematics = ForwardKinematics(skeleton)
        origin = kinematics.poses(np.where(_legs(skeleton), 0.0, skeleton.default_q)[None]).p_ground_body[0]
        hip, knee, ankle = (origin[names.index(b)] for b in ("femur" + side, "tibia" + side, foot))
        legs.append(np.linalg.norm(hip - knee) + np.linalg.norm(knee - ankle))
    return float(np.mean(legs)) / LEG_LENGTH_FRACTION if legs else None


def stature_of_trunk(skeleton: Skeleton) -> float | None:
    """Standing height [m] from hips to shoulders over their share of stature in the default body.

    None where the model has no arms with the field's names.
    """
    names = skeleton.body_names
    if not {"femur_r", "femur_l", "humerus_r", "humerus_l"} <= set(names):
        return None
    joints = ForwardKinematics(skeleton).poses(skeleton.default_q[None]).p_ground_body[0]
    hips, shoulders = (
        joints[[names.index(f"{bone}_r"), names.index(f"{bone}_l")]].mean(axis=0)
        for bone in ("femur", "humerus")
    )
    return float(np.linalg.norm(shoulders - hips)) / lengths(1.0, None).shoulders_above_hips


def _legs(skeleton: Skeleton) -> np.ndarray:
    return np.array([d.startswith(("hip_", "knee_", "ankle_")) for d in skeleton.dofs])


class ScaleJacobian:
    """∂(marker)/∂(log scale factor).

    At fixed angles a marker is the sum of one vector for each body on its way from the ground, and that
    vector scales with the body: from the body's joint to the next body's joint, or to the marker itself.
    """

    def __init__(self, kinematics: ForwardKinematics, groups: ScaleGroups) -> None:
        self.kinematics = kinematics
        self.groups = groups

    def columns(
        self, poses: Poses, q: Float[np.ndarray, "frames dofs"]
    ) -> Float[np.ndarray, "frames markers 3 scales"]:
        """Derivatives [m per unit of log factor], in the order of the groups' log factors."""
        skeleton = self.kinematics.skeleton
        frames = q.shape[0]
        J = np.zeros((frames, len(skeleton.markers), 3, self.groups.size))
        parents = [j.parent for j in skeleton.joints]
        to_child = {child: self._joint_in_parent(child, q) for child, p in enumerate(parents) if p >= 0}
        for m, marker in enumerate(skeleton.markers):
            body, span = marker.body, np.broadcast_to(marker.position_body, (frames, 3))
            while body >= 0:
                vector = span - skeleton.joints[body].p_child_frame
                column = 3 * self.groups.group[body]
                J[:, m, :, column : column + 3] += poses.R_ground_body[:, body] * vector[:, None, :]
                hips = self.groups.hips
                if hips is not None and body in (hips.right, hips.left):
                    J[:, m, :, -1] += poses.R_ground_body[:, hips.pelvis] @ hips.arm(skeleton, body)
                if parents[body] >= 0:
                    span = to_child[body]
                body = parents[body]
        return J

    def _joint_in_parent(
        self, child: int, q: Float[np.ndarray, "frames dofs"]
    ) -> Float[np.ndarray, "frames 3"]:
        """Where the joint of `child` sits in its parent's frame: the part that scales with the parent."""
        joint = self.kinematics.skeleton.joints[child]
        location = np.tile(joint.p_parent_frame, (q.shape[0], 1))
        p, _, _ = self.kinematics.chain.couple(q)
        chain = self.kinematics.chain
        index = {(body, axis): k for k, (body, axis) in enumerate(zip(chain.body, chain.axis, strict=True))}
        for i, axis in enumerate(joint.axes):
            if axis.kind != "translation" or (isinstance(axis.function, Linear) and axis.coordinate):
                continue
            direction = joint.R_parent_frame @ (axis.axis / np.linalg.norm(axis.axis))
            k = index.get((child, i))
            moved = p[:, k] if k is not None else axis.function(np.zeros(q.shape[0]))[0]
            location += moved[:, None] * direction
        return location
