"""Angles by conventions: known poses, and Grood and Suntay's own statement by axes instead of matrices."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solver.kinematics.angle_conventions import angles_by_convention
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import body_poses

BODY = default_skeleton()
DEGREES = np.degrees(0.3)


def posed(frames=1, **coordinates):
    q = np.zeros((frames, len(BODY.dofs)))
    for name, value in coordinates.items():
        q[:, BODY.dofs.index(name)] = value
    return q


def angles(convention, frames=1, **coordinates):
    """Those that are not zero, of one frame."""
    found = angles_by_convention(BODY, posed(frames, **coordinates), convention)
    return {name: values[0] for name, values in found.items() if abs(values[0]) > 1e-6}


@pytest.mark.parametrize(
    ("coordinate", "cgm", "isb"),
    [
        ("hip_flexion_r", {"hip_flexion_r": 1}, {"hip_flexion_r": 1}),
        ("hip_adduction_l", {"hip_adduction_l": 1}, {"hip_adduction_l": 1}),
        ("hip_rotation_r", {"hip_rotation_r": 1}, {"hip_rotation_r": 1}),
        ("hip_rotation_l", {"hip_rotation_l": 1}, {"hip_rotation_l": 1}),
        ("knee_angle_l", {"knee_flexion_l": 1}, {"knee_flexion_l": 1}),
        ("lumbar_extension", {"spine_flexion_r": -1, "spine_flexion_l": -1, "thorax_tilt_r": -1,
                              "thorax_tilt_l": -1}, {"trunk_extension": 1}),
        ("lumbar_bending", {"spine_bending_r": 1, "spine_bending_l": -1, "thorax_obliquity_r": -1,
                            "thorax_obliquity_l": 1}, {"trunk_bending": 1}),
        ("lumbar_rotation", {"spine_rotation_r": -1, "spine_rotation_l": 1, "thorax_rotation_r": 1,
                             "thorax_rotation_l": -1}, {"trunk_rotation": 1}),
    ],
)  # fmt: skip
def test_one_coordinate_of_the_default_body_is_one_angle(coordinate, cgm, isb):
    for convention, expected in (("cgm", cgm), ("isb", isb)):
        found = angles(convention, **{coordinate: 0.3})
        found = {name: value for name, value in found.items() if not name.startswith("shoulder")}
        assert found == pytest.approx({name: sign * DEGREES for name, sign in expected.items()})


def test_an_elbow_bends_about_an_axis_that_is_a_little_oblique_and_the_forearm_turns():
    for convention, side in (("cgm", "r"), ("isb", "l")):
        assert angles(convention, **{f"elbow_flex_{side}": 0.3})[f"elbow_flexion_{side}"] == pytest.approx(
            DEGREES, abs=0.2
        )
    assert angles("isb", pro_sup_l=0.3)["elbow_pronation_l"] == pytest.approx(DEGREES, abs=0.2)


@pytest.mark.parametrize("convention", ["cgm", "isb"])
def test_the_pelvis_falls_forward_hangs_to_the_left_and_turns_to_the_left(convention):
    """OpenSim's own axes: tilt about z, list about x, rotation about y."""
    for coordinate, angle, signs in (
        ("pelvis_tilt", "tilt", (-1, -1)),
        ("pelvis_list", "obliquity", (-1, 1)),
        ("pelvis_rotation", "rotation", (1, -1)),
    ):
        found = angles(convention, **{coordinate: 0.3})
        for side, sign in zip("rl", signs, strict=True):
            assert found[f"pelvis_{angle}_{side}"] == pytest.approx(sign * DEGREES)


def test_only_the_order_about_the_vertical_first_leaves_the_tilt_of_who_turns_alone():
    tilt, obliquity, rotation = Rotation.from_euler("YZ", [0.6, -0.3]).as_euler("ZXY")
    turned = {"pelvis_tilt": tilt, "pelvis_list": obliquity, "pelvis_rotation": rotation}
    assert angles("isb", **turned)["pelvis_tilt_r"] == pytest.approx(DEGREES)
    assert "pelvis_obliquity_r" not in angles("isb", **turned)
    assert angles("cgm", **turned)["pelvis_obliquity_r"] > 8


def floating_axis_angles(R_parent, R_child):
    """Of a right joint, as Grood and Suntay state them: about the parent's z, across, about the child's y."""
    e1, e3 = R_parent[:, 2], R_child[:, 1]
    across = np.cross(e3, e1) / np.linalg.norm(np.cross(e3, e1))
    return np.degrees(
        [
            np.arctan2(across @ R_parent[:, 1], across @ R_parent[:, 0]),
            np.arcsin(e1 @ e3),
            np.arctan2(across @ R_child[:, 2], across @ R_child[:, 0]),
        ]
    )


def test_joint_coordinate_systems_are_grood_and_suntays():
    rng = np.random.default_rng(8)
    q = rng.uniform(-0.5, 0.5, (6, len(BODY.dofs)))
    R, names = body_poses(BODY, q)[0], BODY.body_names
    found = angles_by_convention(BODY, q, "isb")
    for parent, child, three in (
        ("pelvis", "femur_{}", ("hip_flexion", "hip_adduction", "hip_rotation")),
        ("tibia_{}", "calcn_{}", ("ankle_dorsiflexion", "ankle_inversion", "ankle_rotation")),
        ("humerus_{}", "radius_{}", ("elbow_flexion", "elbow_carrying", "elbow_pronation")),
    ):
        for side, mirror in (("r", 1), ("l", -1)):
            for k in range(len(q)):
                one, other = (R[k, names.index(name.format(side))] for name in (parent, child))
                expected = floating_axis_angles(one, other) * [1, mirror, mirror]
                np.testing.assert_allclose(
                    [found[f"{name}_{side}"][k] for name in three], expected, atol=1e-9
                )


def test_the_foot_of_plug_in_gait_is_its_long_axis():
    rng = np.random.default_rng(9)
    q = rng.uniform(-0.5, 0.5, (6, len(BODY.dofs)))
    R, names = body_poses(BODY, q)[0], BODY.body_names
    long = np.einsum("kji,kj->ki", R[:, names.index("tibia_r")], R[:, names.index("calcn_r")][:, :, 0])
    found = angles_by_convention(BODY, q, "cgm")
    np.testing.assert_allclose(found["ankle_dorsiflexion_r"], np.degrees(np.arctan2(long[:, 1], long[:, 0])))
    np.testing.assert_allclose(found["ankle_rotation_r"], np.degrees(np.arcsin(-long[:, 2])))
    assert "ankle_inversion_r" not in found


@pytest.mark.parametrize(("flex", "add", "plane"), [(0.0, -0.7, 0.0), (0.7, 0.0, 90.0), (-0.7, 0.0, -90.0)])
@pytest.mark.parametrize("side", "rl")
def test_an_arm_is_raised_in_a_plane(flex, add, plane, side):
    found = angles("isb", **{f"arm_flex_{side}": flex, f"arm_add_{side}": add})
    assert found[f"shoulder_elevation_{side}"] == pytest.approx(np.degrees(0.7))
    assert found.get(f"shoulder_plane_{side}", 0.0) == pytest.approx(plane, abs=1e-6)
    as_cgm = angles("cgm", **{f"arm_flex_{side}": flex, f"arm_add_{side}": add})
    assert as_cgm.get(f"shoulder_flexion_{side}", 0.0) == pytest.approx(np.degrees(flex), abs=1e-6)
    assert as_cgm.get(f"shoulder_abduction_{side}", 0.0) == pytest.approx(np.degrees(-add), abs=1e-6)


@pytest.mark.parametrize(("way", "heading"), [(2.0, np.pi), (-2.0, np.pi), (0.5, 1.5), (0.5, -1.4)])
def test_the_laboratorys_axis_is_that_of_the_way_or_on_a_treadmill_of_the_face(way, heading):
    """Who walks 2 m along ±x is judged by that; who stays, by the pelvis."""
    q = posed(5, pelvis_rotation=heading + 0.1)
    q[:, BODY.dofs.index("pelvis_tx")] = np.linspace(0.0, way, 5)
    axis = (0.0 if way > 0 else np.pi) if abs(way) > 1 else np.sign(heading) * np.pi / 2
    expected = np.degrees((heading + 0.1 - axis + np.pi) % (2 * np.pi) - np.pi)
    found = angles_by_convention(BODY, q, "isb")["pelvis_rotation_r"]
    np.testing.assert_allclose((found - expected + 180) % 360 - 180, 0.0, atol=1e-9)


def test_axes_of_a_models_bodies_do_not_matter():
    turned, Q = [], Rotation.random(random_state=3).as_matrix()
    femur = BODY.body_names.index("femur_r")
    for body, joint in enumerate(BODY.joints):
        own, parents = (Q if index == femur else np.eye(3) for index in (body, joint.parent))
        turned.append(
            replace(
                joint,
                R_child_frame=own @ joint.R_child_frame,
                p_child_frame=own @ joint.p_child_frame,
                R_parent_frame=parents @ joint.R_parent_frame,
                p_parent_frame=parents @ joint.p_parent_frame,
            )
        )
    q = np.random.default_rng(4).uniform(-0.4, 0.4, (3, len(BODY.dofs)))
    expected = angles_by_convention(BODY, q, "cgm")
    found = angles_by_convention(replace(BODY, joints=tuple(turned)), q, "cgm")
    for name in expected:
        np.testing.assert_allclose(found[name], expected[name], atol=1e-9)


def test_what_is_not_known_is_nan_and_what_a_hinge_cannot_do_is_left_out():
    q = posed(3)
    q[1, BODY.dofs.index("knee_angle_r")] = np.nan
    found = angles_by_convention(BODY, q, "cgm")
    assert np.isnan(found["knee_flexion_r"]).tolist() == [False, True, False]
    assert np.isfinite(found["hip_flexion_r"]).all()
    assert np.isfinite(found["knee_flexion_l"]).all()
    assert not {"knee_adduction_r", "knee_rotation_r", "elbow_adduction_r"} & found.keys()
    nobody = angles_by_convention(BODY, np.full_like(q, np.nan), "isb")
    assert np.isnan(list(nobody.values())).all()
