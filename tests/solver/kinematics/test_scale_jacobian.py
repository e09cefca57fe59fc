import numpy as np
import pytest

from solver.kinematics.scale_prior import ScaleJacobian, scale_groups
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import ForwardKinematics, marker_positions
from tests.solver.kinematics.conftest import walking


def derivatives_match(skeleton, q):
    groups = scale_groups(skeleton)
    rng = np.random.default_rng(1)
    log_scale = rng.normal(0, 0.1, groups.size)
    kinematics = ForwardKinematics(groups.resized(skeleton, log_scale))
    J = ScaleJacobian(kinematics, groups).columns(kinematics.poses(q), q)
    step = 1e-6
    for column in range(groups.size):
        shift = np.zeros_like(log_scale)
        shift[column] = step
        ahead = marker_positions(groups.resized(skeleton, log_scale + shift), q)
        behind = marker_positions(groups.resized(skeleton, log_scale - shift), q)
        np.testing.assert_allclose(J[..., column], (ahead - behind) / (2 * step), atol=1e-8)


def test_scale_derivatives_match_finite_differences(crane, crane_q):
    derivatives_match(crane, crane_q[::20])


@pytest.fixture(scope="module")
def body():
    return default_skeleton(height_m=1.72)


def test_so_they_do_on_a_body_with_hips(body):
    assert scale_groups(body).hips is not None
    derivatives_match(body, walking(body)[::40])


def test_hips_go_apart_and_nothing_else_does(body):
    groups = scale_groups(body)
    log_scale = np.zeros(groups.size)
    log_scale[-1] = np.log(1.2)
    wide = groups.resized(body, log_scale)
    assert groups.hips.width(wide) == pytest.approx(1.2 * groups.hips.width(body))
    thighs = {groups.hips.right, groups.hips.left}
    for i, (before, after) in enumerate(zip(body.joints, wide.joints, strict=True)):
        moved = after.p_parent_frame - before.p_parent_frame
        assert np.flatnonzero(moved).tolist() == ([groups.hips.axis] if i in thighs else [])
    np.testing.assert_array_equal(
        [m.position_body for m in wide.markers], [m.position_body for m in body.markers]
    )
