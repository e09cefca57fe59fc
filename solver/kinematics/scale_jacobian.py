"""How marker positions change with the segments' scale factors, at fixed joint angles."""

import numpy as np
from jaxtyping import Float

from solver.kinematics.scale_prior import ScaleGroups
from solver.skeleton.forward import ForwardKinematics, Poses
from solver.skeleton.functions import Linear


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
