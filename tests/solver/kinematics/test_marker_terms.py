import numpy as np

from solver.kinematics.marker_terms import MarkerTerms
from solver.skeleton.forward import ForwardKinematics, marker_positions


def numerical_jacobian(skeleton, q, step=1e-6):
    columns = []
    for j in range(q.shape[1]):
        ahead, behind = q.copy(), q.copy()
        ahead[:, j] += step
        behind[:, j] -= step
        columns.append((marker_positions(skeleton, ahead) - marker_positions(skeleton, behind)) / (2 * step))
    return np.stack(columns, axis=-1)


def test_normal_equations_equal_the_dense_ones_from_finite_differences(crane, crane_q):
    q = crane_q[::15]
    rng = np.random.default_rng(0)
    kinematics = ForwardKinematics(crane)
    poses = kinematics.poses(q)
    x = kinematics.markers(poses)
    error = rng.normal(size=x.shape)
    weight = rng.uniform(0, 2, x.shape[:2])
    H, g = MarkerTerms(kinematics).normal_equations(poses, x, error, weight)
    J = numerical_jacobian(crane, q)
    np.testing.assert_allclose(H, np.einsum("tmij,tm,tmik->tjk", J, weight, J), rtol=1e-6, atol=1e-7)
    np.testing.assert_allclose(g, np.einsum("tmij,tm,tmi->tj", J, weight, error), rtol=1e-6, atol=1e-7)
