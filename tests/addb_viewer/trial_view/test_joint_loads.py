"""Which torque belongs to which bone."""

from dataclasses import replace

import numpy as np
import pytest

from addb_viewer.trial_view.joint_loads import joint_loads, large_joint_load
from solver.skeleton.default_body import default_skeleton


def test_a_bone_has_the_torque_of_the_joint_that_it_hangs_from_and_the_root_none():
    body = default_skeleton()
    torques = np.zeros((2, len(body.dofs)))
    hip = {"hip_flexion_l": -2.0, "hip_adduction_l": 1.0, "hip_rotation_l": 2.0}
    for name, value in {"knee_angle_r": 3.0, "pelvis_tilt": 50.0, **hip}.items():
        torques[1, body.dofs.index(name)] = value
    sizes = joint_loads(body, torques)
    root = next(i for i, joint in enumerate(body.joints) if joint.parent < 0)
    assert np.isnan(sizes[:, root]).all()
    assert np.nanmax(sizes[0]) == 0
    assert sizes[1, body.body_index("tibia_r")] == 3.0
    assert sizes[1, body.body_index("femur_l")] == 3.0
    assert sizes[1, body.body_index("femur_r")] == sizes[1, body.body_index("tibia_l")] == 0.0


def test_neither_a_spike_nor_frames_without_forces_set_the_scale(small_fit):
    trial, body = small_fit.trials[0], default_skeleton()
    torques = np.zeros((200, len(body.dofs)))
    torques[:, body.dofs.index("knee_angle_r")] = 100.0
    torques[50, body.dofs.index("ankle_angle_r")] = 9000.0
    torques[150:] *= 30.0
    used = np.arange(200) < 150
    dynamics = replace(trial.dynamics, joint_torques=torques, used=used)
    trials = [replace(trial, dynamics=dynamics)]
    assert large_joint_load(body, trials) == pytest.approx(100.0)
    assert large_joint_load(body, [replace(trial, dynamics=None)]) == 0.0
    assert large_joint_load(body, [replace(trial, dynamics=replace(dynamics, used=~used))]) == pytest.approx(
        3000.0
    )
