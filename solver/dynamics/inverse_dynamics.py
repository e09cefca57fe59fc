"""Joint torques τ = M q̈ + C(q, q̇) + g(q) − Jᵀ f, and what the measured forces fail to explain at the root."""

import numpy as np
from jaxtyping import Bool, Float

from solver.common.errors import FitError
from solver.common.frames_at_once import by_frames
from solver.contact.wrenches import ContactWrenches, FrameMask
from solver.dynamics.dynamics import Dynamics
from solver.dynamics.root_wrench import about_point, centre_of_mass, root_centre, root_wrench
from solver.dynamics.settings import DynamicsSettings
from solver.kinematics.motion import Motion
from solver.kinematics.root_joint import root_joint
from solver.skeleton.forward import ForwardKinematics
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.skeleton import Skeleton


def inverse_dynamics(
    skeleton: Skeleton, motion: Motion, contacts: ContactWrenches, mask: FrameMask, settings: DynamicsSettings
) -> Dynamics:
    """Joint torques and residual wrench of a trial.

    A foot whose force does not count enters without it; such frames, those without force data and the trial's
    ends are not used for figures.

    Args:
        skeleton: scaled, with the subject's mass.
        motion: fitted to the forces, or low-passed as they are.
        contacts: filtered with the same cutoff and order.
        mask: which feet's forces count.
        settings: cutoff and ends.

    Raises:
        ModelError: the skeleton's root is not free to move in all six ways.
        FitError: motion, forces and mask are not of the same frames.
    """
    if not motion.frames == contacts.frames == len(mask.counts):
        raise FitError(
            f"Motion has {motion.frames} frames, forces {contacts.frames} and the mask {len(mask.counts)}; "
            "they must be of the same trial at the markers' frames."
        )
    root = root_joint(skeleton)
    wrenches = counted_wrenches(contacts.wrench_ground, mask)
    feet = [skeleton.body_index(name) for name in contacts.foot_bodies]
    moved = motion.without_derivatives()
    kinematics, rigid_bodies = ForwardKinematics(skeleton), RigidBodyModel(skeleton)

    def of_joints(
        q: np.ndarray, v: np.ndarray, a: np.ndarray, under: np.ndarray
    ) -> Float[np.ndarray, "some dofs"]:
        return rigid_bodies.inverse_dynamics(q, v, a, under, feet)

    torques = by_frames(of_joints, moved.q, moved.velocity, moved.acceleration, wrenches)
    del moved

    def placed(
        q: Float[np.ndarray, "some dofs"], own: Float[np.ndarray, "some dofs"]
    ) -> Float[np.ndarray, "some 12"]:
        poses = kinematics.poses(q)
        wrench = root_wrench(root, kinematics.chain, poses, own)
        return np.hstack([root_centre(root, poses), centre_of_mass(skeleton, poses), wrench])

    of_frames = by_frames(placed, motion.q, torques)
    centre, com, wrench = (np.ascontiguousarray(of_frames[:, k]) for k in np.s_[:3, 3:6, 6:])
    residual = about_point(wrench, centre)
    unsmoothed = wrenches - counted_wrenches(contacts.wrench_raw_ground, mask)
    return Dynamics(
        joint_torques=torques,
        residual_root=residual,
        residual_raw_root=residual + about_point(unsmoothed.sum(axis=1), centre),
        com_ground=com,
        root_ground=centre,
        used=used_frames(contacts, mask, settings.end_frames),
        motion=motion,
    )


def counted_wrenches(
    wrench_ground: Float[np.ndarray, "frames feet 6"], mask: FrameMask
) -> Float[np.ndarray, "frames feet 6"]:
    """Zero where a foot's force does not count."""
    return np.where(mask.counts[:, :, None], wrench_ground, 0.0)


def used_frames(contacts: ContactWrenches, mask: FrameMask, end_frames: int) -> Bool[np.ndarray, " frames"]:
    """Frames that figures count: every foot's force counts and was recorded, and no end of the trial is near.

    A trial shorter than four times the ends gives up a quarter at each end.
    """
    used = contacts.observed & mask.all_feet
    ends = min(end_frames, len(used) // 4)
    used[:ends] = False
    used[len(used) - ends :] = False
    return used
