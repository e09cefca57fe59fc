import numpy as np
import pytest

from solver.skeleton.bones import body_meshes
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import body_poses


@pytest.fixture(scope="module")
def drawn():
    skeleton = default_skeleton(mass_kg=80, height_m=1.85, sex="male")
    bones = body_meshes(skeleton)
    R, p = body_poses(skeleton, skeleton.default_q[None])
    extent = {}
    for i, body in enumerate(skeleton.bodies):
        vertices = bones.meshes[body.name].vertices @ R[0, i].T + p[0, i]
        extent[body.name] = (vertices.min(axis=0), vertices.max(axis=0), p[0, i])
    return bones, extent


def test_every_body_has_its_bones(drawn):
    bones, extent = drawn
    assert len(extent) == 22
    assert bones.notes == ()


def test_long_bones_reach_from_joint_to_joint(drawn):
    _, extent = drawn
    for upper, lower in (("femur_r", "tibia_r"), ("tibia_l", "talus_l"), ("humerus_r", "ulna_r")):
        low, high, origin = extent[upper]
        assert high[1] - origin[1] < 0.05
        assert low[1] == pytest.approx(extent[lower][2][1], abs=0.04)


def test_the_skull_fills_the_stature_and_the_feet_stand_on_the_floor(drawn):
    _, extent = drawn
    assert 1.85 - 0.06 < extent["torso"][1][1] < 1.85
    for body in ("calcn_r", "toes_l"):
        assert 0.0 < extent[body][0][1] < 0.025
    assert extent["toes_r"][1][0] - extent["calcn_r"][0][0] == pytest.approx(0.152 * 1.85, abs=0.03)


def test_bones_are_alike_on_both_sides(drawn):
    _, extent = drawn
    for name in ("femur", "calcn", "humerus", "radius"):
        right, left = extent[f"{name}_r"], extent[f"{name}_l"]
        np.testing.assert_allclose(right[0][:2], left[0][:2], atol=0.003)
        np.testing.assert_allclose(right[1][2], -left[0][2], atol=0.003)
