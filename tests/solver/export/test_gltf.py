"""Where a reader of our .glb files, written after the glTF 2.0 specification alone, puts the bodies."""

import json
import struct
from dataclasses import dataclass, replace

import numpy as np
import pytest
import trimesh

from solver.export.gltf import export_gltf, moving_skeleton
from solver.skeleton.bones import body_meshes
from solver.skeleton.pinocchio_model import RigidBodyModel

WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}
TYPES = {5126: "<f4", 5125: "<u4"}


@dataclass(frozen=True)
class Glb:
    """A .glb file: its JSON and its binary chunk."""

    tree: dict
    binary: bytes

    def accessor(self, number):
        accessor = self.tree["accessors"][number]
        view = self.tree["bufferViews"][accessor["bufferView"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        count = accessor["count"] * WIDTHS[accessor["type"]]
        values = np.frombuffer(self.binary, TYPES[accessor["componentType"]], count, start)
        return values.reshape(accessor["count"], -1).astype(float)

    @property
    def names(self):
        return [node["name"] for node in self.tree["nodes"]]

    def parents(self):
        carried = {
            child: n for n, node in enumerate(self.tree["nodes"]) for child in node.get("children", ())
        }
        return [carried.get(n) for n in range(len(self.tree["nodes"]))]

    def at(self, seconds):
        """4 × 4 matrices of all nodes in the scene, halfway values by straight lines."""
        own = [{"translation": [0, 0, 0], "rotation": [0, 0, 0, 1], **node} for node in self.tree["nodes"]]
        (animation,) = self.tree["animations"]
        for channel in animation["channels"]:
            sampler = animation["samplers"][channel["sampler"]]
            times, values = self.accessor(sampler["input"])[:, 0], self.accessor(sampler["output"])
            target = channel["target"]
            own[target["node"]][target["path"]] = [np.interp(seconds, times, v) for v in values.T]
        assert not any("matrix" in node or "scale" in node for node in own)
        local, parents = [placed(node["translation"], node["rotation"]) for node in own], self.parents()

        def ground(n):
            return local[n] if parents[n] is None else ground(parents[n]) @ local[n]

        return {node["name"]: ground(n) for n, node in enumerate(own)}


def placed(translation, quaternion):
    x, y, z, w = np.array(quaternion) / np.linalg.norm(quaternion)
    matrix = np.eye(4)
    matrix[:3, 3] = translation
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return matrix


def read(path):
    content = path.read_bytes()
    magic, edition, length, size, kind = struct.unpack_from("<4sIII4s", content)
    assert (magic, edition, length, kind) == (b"glTF", 2, len(content), b"JSON")
    rest, binary = struct.unpack_from("<I4s", content, 20 + size)
    assert (binary, 28 + size + rest) == (b"BIN\0", len(content))
    return Glb(json.loads(content[20 : 20 + size]), content[28 + size :])


def worst_distance(glb, skeleton, motion, frames):
    """Largest distance [m] of a joint's centre, and of a point 1 m from it, from Pinocchio's places."""
    R, p = RigidBodyModel(skeleton).body_placements(motion.q[frames])
    worst = 0.0
    for row, frame in enumerate(frames):
        matrices = glb.at(frame / motion.rate)
        for body, joint in enumerate(skeleton.joints):
            for point in (joint.p_child_frame, joint.p_child_frame + np.ones(3) / np.sqrt(3)):
                there = matrices[skeleton.bodies[body].name] @ np.append(point, 1.0)
                worst = max(worst, np.linalg.norm(there[:3] - R[row, body] @ point - p[row, body]))
    return worst


def test_bodies_are_where_the_motion_puts_them(fit, tmp_path):
    (path,) = export_gltf(fit, tmp_path / "results" / "gltf")
    assert path == tmp_path / "results" / "gltf" / "walk.glb"
    glb, motion = read(path), fit.trials[0].motion
    assert worst_distance(glb, fit.skeleton, motion, np.arange(0, motion.frames, 9)) < 1e-6


def test_nodes_carry_the_names_and_hang_on_one_another_as_the_bodies_do(fit, tmp_path):
    glb = read(export_gltf(fit, tmp_path)[0])
    assert set(glb.names) == set(fit.skeleton.body_names)
    carrier = dict(zip(glb.names, glb.parents(), strict=True))
    for body, joint in zip(fit.skeleton.bodies, fit.skeleton.joints, strict=True):
        expected = None if joint.parent < 0 else glb.names.index(fit.skeleton.bodies[joint.parent].name)
        assert carrier[body.name] == expected


def test_an_animation_has_the_trials_name_rate_and_clock(fit, tmp_path):
    glb, motion = read(export_gltf(fit, tmp_path)[0]), fit.trials[0].motion
    (animation,) = glb.tree["animations"]
    assert animation["name"] == "walk"
    assert glb.tree["scenes"][0]["extras"] == {"trial": "walk", "rate_Hz": 50.0, "start_time_s": 0.35}
    for sampler in animation["samplers"]:
        times = glb.accessor(sampler["input"])
        np.testing.assert_allclose(times[:, 0], np.arange(motion.frames) / 50.0, atol=1e-6)
        bounds = glb.tree["accessors"][sampler["input"]]
        assert bounds["min"] == [times.min()]
        assert bounds["max"] == [times.max()]


def test_what_does_not_move_in_its_parent_has_no_channel(fit, tmp_path):
    glb = read(export_gltf(fit, tmp_path)[0])
    paths = {
        (glb.names[channel["target"]["node"]], channel["target"]["path"])
        for channel in glb.tree["animations"][0]["channels"]
    }
    root = fit.skeleton.body_names[0]
    assert {(root, "translation"), (root, "rotation"), ("foot_r", "rotation")} <= paths
    assert ("foot_r", "translation") not in paths


def test_quaternions_do_not_jump_between_their_two_signs(fit, tmp_path):
    trial = fit.trials[0]
    turning = trial.motion.q.copy()
    turning[:, fit.skeleton.dofs.index("turn")] = np.linspace(0, 7, len(turning))
    motion = replace(trial.motion, q=turning)
    turned = replace(fit, trials=(replace(trial, motion=motion, dynamics=None),))
    glb = read(export_gltf(turned, tmp_path)[0])
    for channel in glb.tree["animations"][0]["channels"]:
        if channel["target"]["path"] == "rotation":
            values = glb.accessor(glb.tree["animations"][0]["samplers"][channel["sampler"]]["output"])
            np.testing.assert_allclose(np.linalg.norm(values, axis=1), 1.0, atol=1e-6)
            assert (np.sum(values[1:] * values[:-1], axis=1) > 0).all()
    assert worst_distance(glb, fit.skeleton, motion, np.arange(0, 90, 9)) < 1e-6


def test_bones_lie_in_their_bodies_with_unit_normals(fit, tmp_path):
    glb, meshes = read(export_gltf(fit, tmp_path)[0]), body_meshes(fit.skeleton).meshes
    drawn = {node["name"]: node["mesh"] for node in glb.tree["nodes"] if "mesh" in node}
    assert set(drawn) == set(meshes)
    for name, mesh in meshes.items():
        (primitive,) = glb.tree["meshes"][drawn[name]]["primitives"]
        points = glb.accessor(primitive["attributes"]["POSITION"])
        np.testing.assert_allclose([points.min(axis=0), points.max(axis=0)], mesh.bounds, atol=1e-6)
        normals = glb.accessor(primitive["attributes"]["NORMAL"])
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-5)


def test_a_sheet_whose_sides_cancel_still_has_normals(fit, tmp_path, monkeypatch):
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 5, 5]])
    sheet = trimesh.Trimesh(corners, [[0, 1, 2], [2, 1, 0], [1, 1, 1]], process=False)
    bones = replace(body_meshes(fit.skeleton), meshes={"foot_r": sheet})
    monkeypatch.setattr("solver.export.gltf.body_meshes", lambda *_: bones)
    glb = read(export_gltf(fit, tmp_path)[0])
    ((mesh,),) = ([mesh["primitives"][0] for mesh in glb.tree["meshes"]],)
    normals = glb.accessor(mesh["attributes"]["NORMAL"])
    assert len(normals) == 3  # the corner that no face has is gone
    np.testing.assert_allclose(np.abs(normals), [[0, 0, 1]] * 3, atol=1e-6)


@pytest.mark.real
def test_joints_of_a_recorded_walk_lie_within_a_tenth_of_a_millimetre(recorded_walk, tmp_path):
    """The moving knee and its patella, a body a bone, and everything on them."""
    skeleton, motion = recorded_walk
    path = tmp_path / "walk.glb"
    path.write_bytes(moving_skeleton(skeleton, body_meshes(skeleton).meshes, motion, "walk"))
    glb, frames = read(path), np.linspace(0, motion.frames - 1, 10).astype(int)
    assert {"patella_r", "hand_l", "torso"} <= set(glb.names)
    assert worst_distance(glb, skeleton, motion, frames) < 1e-4
