"""Bones of hand-made skeletons and of the real models."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from solver.skeleton import bones
from solver.skeleton.bones import body_meshes, stock_bones, stock_folder
from solver.skeleton.forward import body_poses
from solver.skeleton.osim import load_skeleton
from solver.skeleton.skeleton import Body, Geometry, Joint, Skeleton

X_TO_Y = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])

needs_stock = pytest.mark.skipif(stock_folder() is None, reason="package myo-sim is not installed")


@pytest.fixture(autouse=True)
def own_cache(tmp_path_factory, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.getbasetemp() / "bone-cache"))


@pytest.fixture
def folder(tmp_path) -> Path:
    folder = tmp_path / "Geometry"
    folder.mkdir()
    trimesh.creation.box(bounds=[[0, 0, 0], [1.0, 0.1, 0.1]]).export(folder / "shank.stl")
    return folder


def body(name="shank", *geometry, com=(0.0, -0.1, 0.0)):
    return Body(name, 1.0, np.array(com), np.eye(3), geometry)


def geometry(file, scale=(1, 1, 1), R=None, p=(0, 0, 0)):
    return Geometry(file, np.array(scale, float), np.eye(3) if R is None else R, np.array(p, float))


def joint(name, parent, at):
    return Joint(name, parent, np.eye(3), np.array(at, float), np.eye(3), np.zeros(3), ())


def skeleton(*bodies, knees=()):
    joints = [joint("root", -1, (0, 0, 0)), *(joint(f"joint{i}", 0, at) for i, at in enumerate(knees))]
    return Skeleton("hand-made", bodies, tuple(joints), (), ())


def test_the_users_own_mesh_is_scaled_turned_and_moved(folder):
    bones = body_meshes(skeleton(body("shank", geometry("shank.vtp", (2, 1, 1), X_TO_Y, (5, 0, 0)))), folder)
    np.testing.assert_allclose(bones.meshes["shank"].bounds, [[4.9, 0, 0], [5, 2, 0.1]], atol=1e-6)
    assert bones.notes == ()


def test_a_mirroring_scale_keeps_the_outside_outside(folder):
    bones = body_meshes(skeleton(body("shank", geometry("shank.stl", (1, 1, -1)))), folder)
    assert bones.meshes["shank"].volume == pytest.approx(0.01)


@pytest.mark.parametrize(
    "name", ["../secret.stl", "/etc/secret.stl", r"C:\bones\secret.stl", "Geometry/secret.stl"]
)
def test_a_models_path_never_leaves_the_folder(folder, name):
    trimesh.creation.box().export(folder.parent / "secret.stl")
    bones = body_meshes(skeleton(body("shank", geometry(name))), folder)
    assert "No bone mesh for" in bones.notes[-2]


def test_a_link_out_of_the_folder_is_not_followed(folder):
    trimesh.creation.box().export(folder.parent / "secret.stl")
    (folder / "link.stl").symlink_to(folder.parent / "secret.stl")
    bones = body_meshes(skeleton(body("shank", geometry("link.stl"))), folder)
    assert any("No bone mesh for link.stl" in note for note in bones.notes)


def test_a_spoilt_own_mesh_is_said_and_replaced(folder):
    (folder / "r_tibia.stl").write_bytes(b"")
    bones = body_meshes(skeleton(body("tibia", geometry("r_tibia.vtp"))), folder)
    assert "r_tibia.stl: holds no triangles" in bones.notes[0]
    assert "tibia" in bones.meshes


def test_bodies_without_a_mesh_are_rods_between_joint_centres():
    bones = body_meshes(skeleton(body("thigh"), body("shank"), knees=[(0.1, -0.4, 0.0)]))
    thigh = bones.meshes["thigh"]
    assert thigh.is_watertight
    for end in ([0, 0, 0], [0.1, -0.4, 0]):
        assert np.linalg.norm(thigh.vertices - end, axis=1).min() < 0.03
    assert np.abs(thigh.vertices[:, 2]).max() < 0.04
    np.testing.assert_allclose(bones.meshes["shank"].bounds.mean(axis=0), [0, -0.1, 0], atol=1e-3)
    assert bones.notes == ("Drawn as rods: thigh, shank.",)


def test_bodies_without_extent_have_no_mesh():
    bones = body_meshes(skeleton(body("coupler", com=(0, 0, 0))))
    assert bones.meshes == {}
    assert bones.notes == ()


def test_without_the_stock_bones_everything_is_still_drawn(monkeypatch):
    monkeypatch.setattr("solver.skeleton.bones.stock_folder", lambda: None)
    monkeypatch.setattr("solver.skeleton.bones.stock_folder", lambda: None)
    bones = body_meshes(skeleton(body("tibia", geometry("r_tibia.vtp"))))
    assert "tibia" in bones.meshes
    assert "myo-sim" in bones.notes[0]


@needs_stock
@pytest.mark.parametrize(
    ("file", "stock", "mirrored"),
    [
        ("femur_r.vtp", ["r_femur"], False),
        ("l_femur.vtp", ["l_femur"], False),
        ("femur.vtp", ["r_femur"], False),
        ("FIBULA.VTP", ["r_fibula"], False),
        ("pelvis.vtp", ["r_pelvis"], False),
        ("l_pelvis_raja.vtp", ["l_pelvis"], False),
        ("sacrum.vtp", ["sacrum"], False),
        ("bofoot_l.vtp", ["l_bofoot"], False),
        ("hat_ribs.vtp", ["hat_ribs_scap"], False),
        ("hat_spine.vtp", ["hat_lumbar", "hat_thoracic", "hat_cervical"], False),
        ("humerus_rv.vtp", ["humerus"], False),
        ("humerus_lv.vtp", ["humerus"], True),
        ("capitate_lvs.vtp", ["capitate"], True),
        ("metacarpal3_rvs.vtp", ["3mc"], False),
        ("index_medial_lvs.vtp", ["2midph"], True),
        ("thumb_distal_rvs.vtp", ["thumbdist"], False),
        ("distal_phalanx4_rvs.vtp", ["4distph"], False),
        ("mid_phalanx5_lvs.vtp", ["5midph"], True),
        ("backpack.stl", [], False),
        ("scapula_rv1.vtp", [], False),  # stands in another frame than the stock's
    ],
)
def test_names_of_opensim_find_their_stock_bone(file, stock, mirrored):
    found = stock_bones(file)
    assert [bone.path.stem for bone in found] == stock
    assert all(bone.mirrored == mirrored for bone in found)


@needs_stock
def test_left_and_right_are_mirror_images():
    right, left = (
        body_meshes(skeleton(body("radius", geometry(f"radius_{side}v.vtp")))).meshes["radius"]
        for side in "rl"
    )
    np.testing.assert_allclose(left.vertices, right.vertices * [1, 1, -1], atol=1e-12)
    assert left.volume == pytest.approx(right.volume)


@needs_stock
@pytest.mark.parametrize(
    ("file", "points"),
    [
        # Landmarks read off OpenSim's own files: tips of styloid and olecranon; the condyles and the head.
        ("ulna_rv.vtp", [(-0.0275, -0.2448, 0.0216), (-0.0160, 0.0138, 0.0056), (-0.0007, -0.0124, 0.0012)]),
        (
            "humerus_rv.vtp",
            [(0.0010, -0.2761, -0.0303), (0.0263, -0.2845, 0.0175), (0.0043, 0.0006, -0.0258)],
        ),
        ("middle_distal_rvs.vtp", None),
        ("thumb_distal_rvs.vtp", [(0.0252, -0.0990, 0.0500)]),
    ],
)
def test_arm_bones_lie_where_opensims_files_have_them(file, points):
    mesh = body_meshes(skeleton(body("arm", geometry(file)))).meshes["arm"]
    if points is None:  # OpenSim's fingers are bent, the stock's are straight: only their length compares
        assert -0.19 < mesh.bounds[0, 1] < -0.165
        return
    for point in points:
        assert np.linalg.norm(mesh.vertices - point, axis=1).min() < 0.012, point


@needs_stock
@pytest.mark.real
@pytest.mark.parametrize(
    "model",
    ["models/Rajagopal2016.osim", "models/LaiUhlrich2022.osim", "models/gait2392_thelen2003muscle.osim"],
)
def test_bones_of_real_models_join_where_the_joints_are(real_data, model):
    body_plan = load_skeleton(real_data / model)
    bones = body_meshes(body_plan)
    R, p = (a[0] for a in body_poses(body_plan, body_plan.default_q[None]))
    for index, j in enumerate(body_plan.joints):
        name, parent = body_plan.bodies[index].name, j.parent
        if parent < 0 or name not in bones.meshes or body_plan.bodies[parent].name not in bones.meshes:
            continue
        centre = p[index] + R[index] @ j.p_child_frame
        for member in (index, parent):
            vertices = bones.meshes[body_plan.bodies[member].name].vertices @ R[member].T + p[member]
            # The lumbar joint of Rajagopal's model lies 5 cm before the vertebrae; all others in the bone.
            assert np.linalg.norm(vertices - centre, axis=1).min() < 0.06, (
                name,
                body_plan.bodies[member].name,
            )
    assert not any("Drawn as rods" in note and "femur" in note for note in bones.notes)


@needs_stock
def test_one_size_larger_is_one_size_larger():
    plan = skeleton(body("tibia", geometry("r_tibia.vtp")))
    larger = replace(plan, bodies=(body("tibia", geometry("r_tibia.vtp", scale=(1.2, 1.2, 1.2))),))
    np.testing.assert_allclose(
        body_meshes(larger).meshes["tibia"].bounds, 1.2 * body_meshes(plan).meshes["tibia"].bounds, rtol=1e-9
    )


def test_the_package_is_found_without_importing_it():
    """In a process of its own: other tests use MuJoCo."""
    assert "myo_sim" not in bones.__dict__
    code = "import sys; from solver.skeleton.bones import stock_folder; stock_folder(); "
    code += "sys.exit('mujoco' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)
