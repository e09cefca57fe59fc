"""C3D files that hold poses of segments and no points, as Theia3D writes them."""

import ezc3d
import numpy as np
import pytest

from solver.capture.formats.c3d import read_c3d
from solver.common.errors import CaptureError
from solver.markers.atlas import atlas, landmark_marker
from solver.markers.understanding import understand
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import body_poses, marker_positions

FRAMES, RATE_HZ = 12, 60.0
AXES = np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]])  # columns: right, forwards, up, where ours are x, y, z
TO_LAB = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])  # z up
BODIES = {  # whose turn the segment has, and whose origin
    **{name: (name, name) for name in ("pelvis", "torso")},
    **{
        f"{side}_{segment}": (f"{turned}_{side}", f"{at}_{side}")
        for side in "rl"
        for segment, turned, at in (
            ("thigh", "femur", "femur"),
            ("shank", "tibia", "tibia"),
            ("foot", "calcn", "talus"),
            ("toes", "toes", "toes"),
            ("uarm", "humerus", "humerus"),
            ("larm", "radius", "ulna"),
            ("hand", "hand", "hand"),
        )
    },
}


def poses_of(skeleton, q):
    """In metres, by the names that Theia3D gives, and one that is of no use here."""
    R, p = body_poses(skeleton, q)
    origin = {name: p[:, skeleton.body_index(at)] for name, (_, at) in BODIES.items()}
    origin["pelvis"] = (origin["r_thigh"] + origin["l_thigh"]) / 2
    neck = landmark_marker(atlas()["neck_base"], "neck", skeleton)
    origin["torso"] = marker_positions(skeleton.with_markers([neck]), q)[:, 0]
    poses = {"worldbody_4X4": np.tile(np.eye(4), (len(q), 1, 1)), "head_4X4": np.full((len(q), 4, 4), np.nan)}
    for name, (turned, _) in BODIES.items():
        pose = np.tile(np.eye(4), (len(q), 1, 1))
        axes = R[:, skeleton.body_index(turned)] @ AXES
        if name.endswith("larm"):
            axes = along(origin[name] - origin[f"{name[0]}_hand"], axes[:, :, 1])
        pose[:, :3, :3] = TO_LAB @ axes
        pose[:, :3, 3] = origin[name] @ TO_LAB.T
        poses[f"{name}_4X4"] = pose
    return poses


def along(upwards, forwards):
    """Axes of a segment whose bone is not its body's axis."""
    z = upwards / np.linalg.norm(upwards, axis=1, keepdims=True)
    x = np.cross(forwards, z)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], axis=2)


def write_poses(path, poses, *, unit="mm", ratio=1, rate_hz=RATE_HZ):
    """A file of `rate_hz` poses a second, with frames of that rate over the ratio."""
    whole = np.stack(list(poses.values()), axis=1).copy()
    whole[..., :3, 3] *= {"mm": 1000, "m": 1}[unit]
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [rate_hz / ratio]
    file["parameters"]["POINT"]["UNITS"]["value"] = [unit]
    file["data"]["points"] = np.zeros((4, 0, len(whole) // ratio))
    file.add_parameter("ROTATION", "LABELS", list(poses))
    file.add_parameter("ROTATION", "RATE", [rate_hz])
    file.add_parameter("ROTATION", "USED", [len(poses)])
    file["data"]["rotations"] = whole.transpose(2, 3, 1, 0)
    file.write(str(path))
    return path


@pytest.fixture(scope="module")
def body():
    return default_skeleton()


@pytest.fixture(scope="module")
def postures(body):
    low, high = np.array([c.range for c in body.free_coordinates]).T
    away = (
        0.2 * np.random.default_rng(3).uniform(-1, 1, (FRAMES, len(body.dofs))) * np.minimum(high - low, 3.0)
    )
    away[:, [body.dofs.index(f"pro_sup_{side}") for side in "rl"]] = (
        0.0  # by which the bones of forearms part
    )
    return np.clip(body.default_q + away, low, high)


@pytest.fixture(scope="module")
def poses(body, postures):
    return poses_of(body, postures)


def test_points_lie_where_the_atlas_has_them_in_any_posture(body, postures, poses, tmp_path):
    markers = read_c3d(write_poses(tmp_path / "a.c3d", poses)).markers
    rows = understand(markers.names, [markers]).labels
    assert len(rows) == 3 * len(BODIES)
    assert all(row.used for row in rows)
    marks = [landmark_marker(atlas()[row.landmark], row.label, body) for row in rows]
    there = marker_positions(body.with_markers(marks), postures) @ TO_LAB.T
    np.testing.assert_allclose(markers.positions_ground, there, atol=0.003)


@pytest.mark.parametrize(("unit", "ratio"), [("m", 1), ("mm", 2)])
def test_rate_is_that_of_the_poses_and_the_unit_that_of_points(poses, tmp_path, unit, ratio):
    usual = read_c3d(write_poses(tmp_path / "a.c3d", poses)).markers
    other = read_c3d(write_poses(tmp_path / "b.c3d", poses, unit=unit, ratio=ratio)).markers
    assert other.rate == RATE_HZ
    np.testing.assert_allclose(other.positions_ground, usual.positions_ground, atol=1e-6)


def test_where_a_segment_has_no_pose_its_points_are_unseen(poses, tmp_path):
    some = {name: pose.copy() for name, pose in poses.items()}
    some["r_shank_4X4"][2:4] = np.nan
    some["l_foot_4X4"][5] = 0.0
    path = write_poses(tmp_path / "a.c3d", some)
    numbers = np.fromfile(path, "<f4")
    start = int(ezc3d.c3d(str(path))["parameters"]["ROTATION"]["DATA_START"]["value"][0] - 1) * 128
    numbers[start + (7 * len(some) + list(some).index("r_hand_4X4")) * 17 + 16] = -1.0
    numbers.tofile(path)
    markers = read_c3d(path).markers
    unseen = np.isnan(markers.positions_ground).any(axis=2)
    expected = np.zeros_like(unseen)
    for name, frames in (("r_shank", [2, 3]), ("l_foot", [5]), ("r_hand", [7])):
        for end in ("", "_y", "_z"):
            expected[frames, markers.names.index(name + end)] = True
    np.testing.assert_array_equal(unseen, expected)


def test_without_a_whole_leg_the_segments_are_listed(poses, tmp_path):
    sensors = {f"Sensor{k}": pose for k, pose in enumerate(poses.values())}
    with pytest.raises(CaptureError, match=r"no whole leg .*r_thigh.*Sensor0"):
        read_c3d(write_poses(tmp_path / "a.c3d", sensors))


def test_a_cut_file_is_refused_before_ezc3d_ends_the_program(poses, tmp_path):
    path = write_poses(tmp_path / "a.c3d", poses)
    path.write_bytes(path.read_bytes()[:-4096])
    with pytest.raises(CaptureError, match=r"cut off.*rotations"):
        read_c3d(path)


def test_a_count_of_rotations_that_cannot_be_is_refused(poses, tmp_path):
    path = write_poses(tmp_path / "a.c3d", poses)
    data = path.read_bytes()
    at = data.index(b"RATIO")  # behind the name: two bytes to the next, type, number of dimensions, these
    value = at + 5 + 4 + data[at + 5 + 3]
    path.write_bytes(data[:value] + b"\0\0" + data[value + 2 :])
    with pytest.raises(CaptureError, match="RATIO"):
        read_c3d(path)
