"""The residual wrench as rows of a body whose inertias, motion and extra wrench all move."""

from dataclasses import replace

import numpy as np

from solver.dynamics.momentum_terms import momentum_terms
from solver.dynamics.root_wrench import root_centre
from solver.dynamics.trajectory.terms.root_residual import RootResidual
from solver.dynamics.trajectory.trajectory_settings import TrajectorySettings
from solver.kinematics.root_joint import root_joint
from solver.skeleton.pinocchio_model import RigidBodyModel

TRUSTING = TrajectorySettings(residual_robust_scale=1e6)


def test_gauss_newton_is_that_of_dense_rows(case):
    data = case.data
    std = np.repeat([TRUSTING.residual_force_std_N, TRUSTING.residual_moment_std_Nm], 3)

    def rows(iterate):
        at = case.at(iterate)
        q, v, a = (at.basis.evaluate(at.coefficients, order) for order in range(3))
        acting = data.wrench_ground + data.extra_wrench_ground + data.extra_columns_ground @ at.shared.x
        skeleton = case.inertias.skeleton_at(at.shared.phi)
        required = momentum_terms(RigidBodyModel(skeleton), q, v, a, np.zeros_like(acting))
        wrench = required.residual
        wrench[:, 3:] += np.cross(required.com_ground, wrench[:, :3])
        wrench = wrench - acting
        centre = root_centre(root_joint(skeleton), at.kinematics.poses(q))
        wrench[:, 3:] -= np.cross(centre, wrench[:, :3])
        return np.sqrt(case.frame_weight) * (wrench / std)[data.counts].ravel()

    case.assert_least_squares(RootResidual(data, TRUSTING), rows)


def test_frames_of_unknown_force_have_no_say(case):
    told = case.data.wrench_ground.copy()
    told[~case.data.counts] += 1e4
    told[~case.data.counts, 0] = np.nan
    other = RootResidual(replace(case.data, wrench_ground=told), TRUSTING)
    one, two = (case.system(t, case.iterate) for t in (RootResidual(case.data, TRUSTING), other))
    assert two.gradient.cost == one.gradient.cost
    np.testing.assert_array_equal(two.band.panels, one.band.panels)
    np.testing.assert_array_equal(two.border, one.border)
