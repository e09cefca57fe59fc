from dataclasses import replace

import numpy as np
import pytest

from solver.kinematics.label_reading import ReadLabels
from solver.kinematics.own_model_naming import carried_over
from solver.markers.understanding import Understanding, UnderstoodLabel
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.skeleton import Marker, Skeleton

PLACE = np.array([0.03, -0.2, 0.05])


@pytest.fixture(scope="module")
def default():
    return default_skeleton()


def found(default: Skeleton, confidence: float = 0.9) -> ReadLabels:
    row = UnderstoodLabel("M1", "thigh_cluster_r", "femur_r", confidence, None, "")
    marker = Marker("M1", default.body_index("femur_r"), PLACE, spread_m=0.03)
    return ReadLabels(Understanding((row,), ()), {"M1": marker})


def test_a_marker_is_carried_over_to_a_body_of_another_size(default):
    taller = default_skeleton(height_m=1.1 * 1.72)
    marker = carried_over(found(default), ["M1"], default, taller)["M1"]
    assert taller.bodies[marker.body].name == "femur_r"
    np.testing.assert_allclose(marker.position_body, 1.1 * PLACE, rtol=1e-3)
    assert marker.spread_m > 0.03  # looser than where it was measured


def test_a_body_whose_frame_lies_otherwise_gets_none(default):
    other = replace(default, joints=tuple(_with_knee_moved(default)), markers=())
    assert carried_over(found(default), ["M1"], default, default)
    assert carried_over(found(default), ["M1"], default, other) == {}


def test_doubtful_markers_and_bodies_that_the_model_lacks_are_left_out(default):
    assert carried_over(found(default, confidence=0.4), ["M1"], default, default) == {}
    renamed = replace(
        default, bodies=tuple(replace(b, name=b.name.replace("femur", "thigh")) for b in default.bodies)
    )
    assert carried_over(found(default), ["M1"], default, renamed) == {}


def _with_knee_moved(skeleton: Skeleton):
    """What hangs on the femur, 10 cm further up."""
    femur = skeleton.body_index("femur_r")
    for joint in skeleton.joints:
        up = np.array([0.0, 0.1 * (joint.parent == femur), 0.0])
        yield replace(joint, p_parent_frame=joint.p_parent_frame + up)
