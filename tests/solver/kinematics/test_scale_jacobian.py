import numpy as np

from solver.kinematics.scale_jacobian import ScaleJacobian
from solver.kinematics.scale_prior import scale_groups
from solver.skeleton.forward import ForwardKinematics, marker_positions
from solver.skeleton.scaling import scaled


def test_scale_derivatives_match_finite_differences(crane, crane_q):
    q = crane_q[::20]
    groups = scale_groups(crane)
    rng = np.random.default_rng(1)
    log_scale = rng.normal(0, 0.1, 3 * groups.count)
    kinematics = ForwardKinematics(scaled(crane, groups.factors(log_scale), None))
    J = ScaleJacobian(kinematics, groups).columns(kinematics.poses(q), q)
    step = 1e-6
    for column in range(3 * groups.count):
        shift = np.zeros_like(log_scale)
        shift[column] = step
        ahead = marker_positions(scaled(crane, groups.factors(log_scale + shift), None), q)
        behind = marker_positions(scaled(crane, groups.factors(log_scale - shift), None), q)
        np.testing.assert_allclose(J[..., column], (ahead - behind) / (2 * step), atol=1e-8)
