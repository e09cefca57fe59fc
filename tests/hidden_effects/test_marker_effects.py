import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solver.capture.capture import Markers
from solver.simulate.faults import recorded
from solver.skeleton.forward import body_poses


@pytest.fixture(scope="module")
def segment():
    """Four markers of a rigid body that turns and travels."""
    rng = np.random.default_rng(3)
    t = np.arange(120) / 100
    turn = Rotation.from_rotvec(np.stack([0.5 * np.sin(3 * t), 0.9 * t, 0.3 * np.cos(2 * t)], axis=1))
    shape = rng.uniform(-0.1, 0.1, (4, 3))
    points = np.stack([turn.apply(p) for p in shape], axis=1) + t[:, None, None] * np.array([1.0, 0.1, 0])
    return Markers(tuple("ABCD"), points, 100.0), turn


def test_registration_finds_the_turning_of_the_body(segment):
    markers, turn = segment
    R, centroid = recorded.registered(markers, list("ABCD"))
    relative = R @ R[0].T
    np.testing.assert_allclose(relative, (turn * turn[0].inv()).as_matrix(), atol=1e-9)
    np.testing.assert_allclose(centroid, markers.positions_ground.mean(axis=1), atol=1e-9)


def test_registration_bridges_gaps(segment):
    markers, _ = segment
    positions = markers.positions_ground.copy()
    positions[40:44] = np.nan
    positions[60:70, 2] = np.nan
    R, _ = recorded.registered(Markers(markers.names, positions, 100.0), list("ABCD"))
    whole, _ = recorded.registered(markers, list("ABCD"))
    relative = np.einsum("tji,tjk->tik", R, whole)
    angles = Rotation.from_matrix(relative @ relative[0].T).magnitude()
    assert angles.max() < 0.01


def test_a_slipped_marker_stays_where_it_slipped_to_in_the_body(segment):
    markers, turn = segment
    R, _ = recorded.registered(markers, list("ABCD"))
    wrong = recorded.slipped(markers, "B", np.array([0.009, -0.012, 0.0]), 0.5, R)
    in_body = np.stack(
        [turn[t].inv().apply((wrong.positions_ground - markers.positions_ground)[t]) for t in range(120)]
    )
    assert not in_body[:50].any()
    np.testing.assert_allclose(np.linalg.norm(in_body[50:, 1], axis=1), 0.015)
    np.testing.assert_allclose(in_body[50:, 1], in_body[50, 1] * np.ones((70, 1)), atol=1e-9)
    assert not in_body[:, [0, 2, 3]].any()


def test_a_swap_exchanges_two_and_ends(segment):
    markers, _ = segment
    wrong = recorded.swapped(markers, "A", "D", 20, 30).positions_ground
    true = markers.positions_ground
    np.testing.assert_array_equal(wrong[20:30, 0], true[20:30, 3])
    np.testing.assert_array_equal(wrong[20:30, 3], true[20:30, 0])
    np.testing.assert_array_equal(wrong[[19, 30]], true[[19, 30]])


def test_a_scale_multiplies_every_distance(segment):
    markers, _ = segment
    wrong = recorded.rescaled(markers, 1.01).positions_ground
    far = lambda p: np.linalg.norm(p[:, 0] - p[:, 3], axis=1)  # noqa: E731
    np.testing.assert_allclose(far(wrong), 1.01 * far(markers.positions_ground))


def test_soft_tissue_moves_a_segments_markers_alike_and_with_the_joint_angle(recording, walk_world):
    markers = recording.trials[0].markers
    names = {
        b: [n for n, body in recording.marker_bodies.items() if body == b] for b in ("femur_r", "tibia_r")
    }
    R, R_next = (recorded.registered(markers, names[b])[0] for b in ("femur_r", "tibia_r"))
    direction = np.array([[0.2, 0.5, 1.0], [0.0, 0.3, 0.4], [0.1, 0.0, 0.7]])
    wrong = recorded.soft(
        markers, names["femur_r"], R_ground=R, R_next=R_next, direction=direction, rms_m=0.010
    )
    moved = wrong.positions_ground - markers.positions_ground
    columns = [markers.names.index(n) for n in names["femur_r"]]
    assert np.sqrt(np.nanmean(np.sum(moved[:, columns] ** 2, axis=2))) == pytest.approx(0.010, rel=0.02)
    others = np.delete(np.arange(len(markers.names)), columns)
    assert not np.nan_to_num(moved[:, others]).any()
    spread = np.nanmax(moved[:, columns], axis=1) - np.nanmin(moved[:, columns], axis=1)
    assert np.nanmax(np.abs(spread)) < 1e-12
    motion = walk_world.trial.frames(100.0)
    knee = motion.q[:, motion.dofs.index("knee_angle_r")]
    poses = body_poses(walk_world.body.skeleton, motion.q)[0]
    femur = poses[:, walk_world.body.skeleton.body_index("femur_r")]
    in_body = np.einsum("tji,tj->ti", femur, moved[:, columns[0]])
    seen = np.isfinite(in_body).all(axis=1)
    design = np.stack([np.ones(seen.sum()), knee[seen]], axis=1)
    left = in_body[seen] - design @ np.linalg.lstsq(design, in_body[seen], rcond=None)[0]
    assert np.sqrt(np.mean(left**2)) < 0.25 * np.sqrt(np.mean(in_body[seen] ** 2))
