"""Which coordinates and joints a file speaks of."""

from dataclasses import replace

import numpy as np

from solver.export.b3d.model import dofs_in_order, joints_in_order, unlocked_motion
from solver.kinematics.motion import Motion
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.skeleton import Body, Joint


def test_locked_coordinates_count_and_coupled_ones_do_not(crane):
    assert dofs_in_order(crane) == (
        *("tilt", "list", "turn", "tx", "ty", "tz", "hip_flexion", "hip_adduction", "hip_rotation"),
        *("knee_angle", "ankle_angle", "locked_angle", "arm_angle"),
    )


def test_the_patella_is_no_joint(crane):
    assert [crane.joints[j].name for j in joints_in_order(crane)] == [
        "root",
        "hip",
        "knee",
        "ankle",
        "shoulder",
    ]


def test_limb_by_limb_whatever_the_order_of_the_bodies(crane):
    """Bodies sorted by their distance from the root are in topological order, too."""
    order = [0, 1, 5, 2, 3, 4]
    joints = [crane.joints[i] for i in order]
    moved = replace(
        crane,
        bodies=tuple(crane.bodies[i] for i in order),
        joints=tuple(replace(j, parent=order.index(j.parent) if j.parent >= 0 else -1) for j in joints),
        markers=(),
    )
    assert dofs_in_order(moved) == dofs_in_order(crane)
    assert [moved.joints[j].name for j in joints_in_order(moved)] == [
        "root",
        "hip",
        "knee",
        "ankle",
        "shoulder",
    ]


def test_welds_are_joints(crane):
    weld = Joint("weld", 5, np.eye(3), np.zeros(3), np.eye(3), np.zeros(3), ())
    hand = Body("hand_r", 0.4, np.zeros(3), np.eye(3) * 1e-3)
    longer = replace(crane, bodies=(*crane.bodies, hand), joints=(*crane.joints, weld))
    assert [longer.joints[j].name for j in joints_in_order(longer)][-2:] == ["shoulder", "weld"]


def test_the_default_body():
    skeleton = default_skeleton()
    dofs = dofs_in_order(skeleton)
    assert len(dofs) == 37
    assert dofs[:10] == (
        *("pelvis_tilt", "pelvis_list", "pelvis_rotation", "pelvis_tx", "pelvis_ty", "pelvis_tz"),
        *("hip_flexion_r", "hip_adduction_r", "hip_rotation_r", "knee_angle_r"),
    )
    assert len(joints_in_order(skeleton)) == 20


def test_locked_coordinates_stand_still(crane, crane_q):
    motion = unlocked_motion(Motion(crane.dofs, crane_q, 50.0), crane)
    locked = motion.dofs.index("locked_angle")
    np.testing.assert_array_equal(motion.q[:, locked], 0.2)
    np.testing.assert_allclose(motion.acceleration[:, locked], 0.0, atol=1e-9)
    np.testing.assert_array_equal(np.delete(motion.q, locked, axis=1), crane_q)
