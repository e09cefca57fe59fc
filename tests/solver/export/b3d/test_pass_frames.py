"""Every series of a pass against its definition: differences along the motion, Newton, moved wrenches."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from solver.capture.capture import Capture, ForcePlate, Markers
from solver.capture.formats.b3d.frames import present
from solver.capture.plates.force_settings import CONDITIONING
from solver.common.frames_at_once import spans
from solver.dynamics.root_wrench import centre_of_mass
from solver.export.b3d import pass_frames
from solver.export.b3d.from_fit import fit_to_b3d
from solver.export.b3d.pass_frames import (
    ContactForces,
    SeriesOnDisk,
    central_axis,
    dofs_in_order,
    joints_in_order,
    marker_names,
    sensor_frames,
    trial_header,
    unlocked,
    unlocked_motion,
)
from solver.kinematics.motion import Motion
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import ForwardKinematics
from solver.skeleton.skeleton import Body, Joint

STEP = 1e-5
RATE, TIMES = 100.0, np.arange(10) / 100


@pytest.fixture
def frames(fit):
    (trial,) = fit_to_b3d(fit).trials
    return trial.passes[0]


@pytest.fixture
def moved(fit):
    """The skeleton with all its degrees of freedom, and q, q̇, q̈ in its own order."""
    skeleton = unlocked(fit.skeleton)
    motion = unlocked_motion(fit.trials[0].dynamics.motion, fit.skeleton)
    return skeleton, motion.q, motion.velocity, motion.acceleration


def poses(skeleton, q):
    return ForwardKinematics(skeleton).poses(q)


def root_of(skeleton, q):
    found = poses(skeleton, q)
    return found.R_ground_body[:, 0], found.p_ground_body[:, 0]


def difference(function, q, rate):
    return (function(q + STEP * rate) - function(q - STEP * rate)) / (2 * STEP)


def in_root(R, vectors):
    return np.einsum("tji,tj->ti", R, vectors)


def test_motion_in_the_order_of_the_format(fit, frames):
    motion, dofs = fit.trials[0].dynamics.motion, dofs_in_order(fit.skeleton)
    for name in motion.dofs:
        np.testing.assert_array_equal(frames.pos[:, dofs.index(name)], motion.q[:, motion.dofs.index(name)])
    np.testing.assert_array_equal(frames.pos[:, dofs.index("locked_angle")], 0.2)
    np.testing.assert_array_equal(
        frames.vel[:, dofs.index("tx")], motion.velocity[:, motion.dofs.index("tx")]
    )


def test_torques_are_those_of_the_fit(fit, frames):
    dofs = dofs_in_order(fit.skeleton)
    columns = [dofs.index(name) for name in fit.skeleton.dofs]
    np.testing.assert_allclose(frames.tau[:, columns], fit.trials[0].dynamics.joint_torques, atol=1e-9)
    assert np.abs(frames.tau[:, dofs.index("locked_angle")]).max() > 0.01  # what holds it


def test_the_centre_of_mass_moves_as_its_derivatives_say(moved, frames):
    skeleton, q, v, a = moved
    np.testing.assert_allclose(frames.com_pos, centre_of_mass(skeleton, poses(skeleton, q)), atol=1e-12)

    def along(h):
        return centre_of_mass(skeleton, poses(skeleton, q + h * v + h**2 / 2 * a))

    np.testing.assert_allclose(frames.com_vel, (along(STEP) - along(-STEP)) / (2 * STEP), atol=1e-7)
    h = 1e-3
    second = (along(h) - 2 * along(0.0) + along(-h)) / h**2
    np.testing.assert_allclose(frames.com_acc + skeleton.gravity, second, atol=2e-3)


def test_forces_and_residual_accelerate_the_mass(fit, frames):
    """Newton's law, in the ground frame and in the root's: m (a − g) = Σ f + what is missing."""
    mass = fit.skeleton.mass
    required = mass * frames.com_acc - frames.ground_contact_force
    np.testing.assert_allclose(required, fit.trials[0].dynamics.residual_root[:, :3], atol=1e-8)
    in_root_frame = mass * frames.root_frame_com_acc - frames.root_frame_ground_contact_force
    np.testing.assert_allclose(in_root_frame, frames.root_frame_residual[:, 3:], atol=1e-8)


def test_the_residual_about_the_roots_origin(fit, moved, frames):
    skeleton, q, *_ = moved
    R, origin = root_of(skeleton, q)
    dynamics = fit.trials[0].dynamics
    force, moment = dynamics.residual_root[:, :3], dynamics.residual_root[:, 3:]
    moment = moment + np.cross(dynamics.root_ground - origin, force)
    np.testing.assert_allclose(frames.root_frame_residual[:, :3], in_root(R, moment), atol=1e-8)


def test_a_contact_is_one_wrench_in_four_forms(moved, frames, contacts):
    skeleton, q, *_ = moved
    R, origin = root_of(skeleton, q)
    wrench = frames.ground_contact_wrench
    np.testing.assert_array_equal(wrench[:, 3:], contacts.wrench_ground[:, 0, :3])
    np.testing.assert_array_equal(wrench[:, :3], contacts.wrench_ground[:, 0, 3:])
    for point, torque, force, moment in (
        (
            frames.ground_contact_center_of_pressure,
            frames.ground_contact_torque,
            frames.ground_contact_force,
            wrench[:, :3],
        ),
        (
            frames.root_frame_ground_contact_center_of_pressure,
            frames.root_frame_ground_contact_torques,
            frames.root_frame_ground_contact_force,
            frames.root_frame_ground_contact_wrench[:, :3],
        ),
    ):
        np.testing.assert_allclose(np.cross(point, force) + torque, moment, atol=1e-9)
    ground = frames.root_frame_ground_contact_center_of_pressure[:, None] @ R.transpose(0, 2, 1)
    np.testing.assert_allclose(ground[:, 0] + origin, frames.ground_contact_center_of_pressure, atol=1e-12)
    np.testing.assert_allclose(in_root(R, wrench[:, 3:]), frames.root_frame_ground_contact_force, atol=1e-9)


def test_the_point_lies_on_the_plate_and_its_torque_along_the_force(contacts):
    force, moment = contacts.wrench_ground[..., :3], contacts.wrench_ground[..., 3:]
    point, torque = central_axis(ContactForces(("foot_r",), force, moment, contacts.cop_ground[..., 1]))
    loaded = slice(20, 60)
    np.testing.assert_allclose(point[loaded, 0, 1], 0.01, atol=1e-12)
    np.testing.assert_allclose(np.cross(torque, force)[loaded], 0.0, atol=1e-9)
    away = np.linalg.norm(point - contacts.cop_ground, axis=2)[loaded]
    assert 0 < away.max() < 0.002  # a free moment of 3 N·m at 300 N
    unloaded = np.r_[0:20, 60:90]
    np.testing.assert_array_equal(point[unloaded], 0.0)
    np.testing.assert_array_equal(torque[unloaded], moment[unloaded])


def test_joint_centres(fit, moved, frames):
    skeleton, q, *_ = moved
    R, origin = root_of(skeleton, q)
    world = frames.world_frame_joint_centers.reshape(len(q), -1, 3)
    seen = frames.root_frame_joint_centers.reshape(len(q), -1, 3)
    assert world.shape[1] == 5
    np.testing.assert_allclose(np.einsum("tij,tkj->tki", R, seen) + origin[:, None], world, atol=1e-12)
    hip = [0.02, -0.05, 0.08]  # where the pelvis carries it
    np.testing.assert_allclose(seen[:, 1], np.tile(hip, (len(q), 1)), atol=1e-12)


def test_the_roots_twist(moved, frames):
    skeleton, q, v, _ = moved
    R, _ = root_of(skeleton, q)
    linear = difference(lambda q: root_of(skeleton, q)[1], q, v)
    np.testing.assert_allclose(frames.root_frame_spatial_velocity[:, 3:], in_root(R, linear), atol=1e-8)
    turned = Rotation.from_matrix(R.transpose(0, 2, 1) @ root_of(skeleton, q + STEP * v)[0])
    np.testing.assert_allclose(
        frames.root_frame_spatial_velocity[:, :3], turned.as_rotvec() / STEP, atol=1e-3
    )


def test_the_roots_acceleration_is_the_twist_that_the_accelerations_would_make(moved, frames):
    skeleton, q, v, a = moved
    R, _ = root_of(skeleton, q)
    h = 1e-3
    path = [root_of(skeleton, q + s * v + s**2 / 2 * a)[1] for s in (h, 0.0, -h)]
    second = (path[0] - 2 * path[1] + path[2]) / h**2 - skeleton.gravity
    np.testing.assert_allclose(frames.root_frame_spatial_acceleration[:, 3:], in_root(R, second), atol=1e-6)
    turned = Rotation.from_matrix(R.transpose(0, 2, 1) @ root_of(skeleton, q + STEP * a)[0])
    np.testing.assert_allclose(
        frames.root_frame_spatial_acceleration[:, :3], turned.as_rotvec() / STEP, rtol=1e-3, atol=1e-2
    )


def test_where_the_root_was(moved, frames):
    skeleton, q, *_ = moved
    R, origin = root_of(skeleton, q)
    places = frames.root_frame_root_pos_history.reshape(len(q), -1, 3)
    angles = frames.root_frame_root_euler_history.reshape(len(q), -1, 3)
    assert places.shape[1] == 10
    np.testing.assert_allclose(places[:, 0], 0.0, atol=1e-12)
    np.testing.assert_allclose(places[40, 4], R[40].T @ (origin[28] - origin[40]), atol=1e-12)
    np.testing.assert_allclose(
        Rotation.from_euler("XYZ", angles[40, 4]).as_matrix(), R[40].T @ R[28], atol=1e-12
    )
    np.testing.assert_array_equal(places[5, 2:], 0.0)
    np.testing.assert_array_equal(angles[5, 2:], 0.0)


@pytest.mark.parametrize("on_disk", [False, True])
def test_a_long_pass_in_pieces_is_the_whole(fit, frames, on_disk, monkeypatch, tmp_path):
    """Pieces shorter than what a frame remembers."""
    monkeypatch.setattr(pass_frames, "spans", lambda count, _=0: spans(count, most=11))
    (trial,) = fit_to_b3d(fit, scratch=tmp_path if on_disk else None).trials
    whole, found = present(frames), present(trial.passes[0])

    assert found.keys() == whole.keys()
    assert all(isinstance(series, SeriesOnDisk) == on_disk for series in found.values())
    for name, series in found.items():
        np.testing.assert_allclose(np.asarray(series), whole[name], rtol=0, atol=1e-9)
        np.testing.assert_array_equal(series[5:17], np.asarray(series)[5:17])
    assert not list(tmp_path.iterdir())


def test_locked_coordinates_count_and_coupled_ones_do_not(crane):
    assert dofs_in_order(crane) == (
        *("tilt", "list", "turn", "tx", "ty", "tz", "hip_flexion", "hip_adduction", "hip_rotation"),
        *("knee_angle", "ankle_angle", "locked_angle", "arm_angle"),
    )


def test_the_patella_is_no_joint(crane):
    assert [crane.joints[j].name for j in joints_in_order(crane)] == [
        "root",
        "hip",
        "knee",
        "ankle",
        "shoulder",
    ]


def test_limb_by_limb_whatever_the_order_of_the_bodies(crane):
    """Bodies sorted by their distance from the root are in topological order, too."""
    order = [0, 1, 5, 2, 3, 4]
    joints = [crane.joints[i] for i in order]
    moved = replace(
        crane,
        bodies=tuple(crane.bodies[i] for i in order),
        joints=tuple(replace(j, parent=order.index(j.parent) if j.parent >= 0 else -1) for j in joints),
        markers=(),
    )
    assert dofs_in_order(moved) == dofs_in_order(crane)
    assert [moved.joints[j].name for j in joints_in_order(moved)] == [
        "root",
        "hip",
        "knee",
        "ankle",
        "shoulder",
    ]


def test_welds_are_joints(crane):
    weld = Joint("weld", 5, np.eye(3), np.zeros(3), np.eye(3), np.zeros(3), ())
    hand = Body("hand_r", 0.4, np.zeros(3), np.eye(3) * 1e-3)
    longer = replace(crane, bodies=(*crane.bodies, hand), joints=(*crane.joints, weld))
    assert [longer.joints[j].name for j in joints_in_order(longer)][-2:] == ["shoulder", "weld"]


def test_the_default_body():
    skeleton = default_skeleton()
    dofs = dofs_in_order(skeleton)
    assert len(dofs) == 37
    assert dofs[:10] == (
        *("pelvis_tilt", "pelvis_list", "pelvis_rotation", "pelvis_tx", "pelvis_ty", "pelvis_tz"),
        *("hip_flexion_r", "hip_adduction_r", "hip_rotation_r", "knee_angle_r"),
    )
    assert len(joints_in_order(skeleton)) == 20


def test_locked_coordinates_stand_still(crane, crane_q):
    motion = unlocked_motion(Motion(crane.dofs, crane_q, 50.0), crane)
    locked = motion.dofs.index("locked_angle")
    np.testing.assert_array_equal(motion.q[:, locked], 0.2)
    np.testing.assert_allclose(motion.acceleration[:, locked], 0.0, atol=1e-9)
    np.testing.assert_array_equal(np.delete(motion.q, locked, axis=1), crane_q)


def plate(force, cop, *, name="1", rate=RATE, start=0.0, corners_ground=None):
    """A plate whose free moment is 2 N·m about y."""
    moment = np.cross(np.nan_to_num(cop), force) + np.array([0.0, 2.0, 0.0])
    return ForcePlate(name, force, moment, cop, rate, start, corners_ground)


def capture(*plates, markers=None):
    positions = np.arange(60.0).reshape(10, 2, 3)
    positions[4, 1] = np.nan
    return Capture("walk", markers or Markers(("C7", "T10"), positions, RATE), plates)


@pytest.fixture
def standing():
    force = np.column_stack([5 * np.sin(20 * TIMES), 700 + 0 * TIMES, 0 * TIMES])
    return plate(force, np.tile([0.3, 0.02, -0.1], (10, 1)))


def test_markers_in_the_order_of_the_subject():
    found = sensor_frames(capture(), ("T10", "LASI", "C7"), plates=0, settings=CONDITIONING)
    observed = found.marker_obs.reshape(10, 3, 3)
    np.testing.assert_array_equal(observed[:, 2], capture().markers.positions_ground[:, 0])
    assert np.isnan(observed[:, 1]).all()
    assert np.isnan(observed[:, 0]).any(axis=1).tolist() == [t == 4 for t in range(10)]
    assert found.raw_force_plate_force.shape == (10, 0)


def test_the_moment_is_about_the_point(standing):
    found = sensor_frames(capture(standing), ("C7", "T10"), plates=1, settings=CONDITIONING)
    np.testing.assert_allclose(found.raw_force_plate_force, standing.force_ground, atol=1e-9)
    np.testing.assert_allclose(found.raw_force_plate_cop, standing.cop_ground, atol=1e-9)
    np.testing.assert_allclose(found.raw_force_plate_torque, [[0, 2, 0]] * 10, atol=1e-9)


def test_without_a_point_the_moment_is_about_the_origin():
    force = np.tile([0.5, 1.5, 0.0], (10, 1))
    idle = plate(force, np.full((10, 3), np.nan))
    found = sensor_frames(capture(idle), ("C7", "T10"), plates=1, settings=CONDITIONING)
    np.testing.assert_array_equal(found.raw_force_plate_cop, 0.0)
    np.testing.assert_allclose(found.raw_force_plate_torque, idle.moment_ground, atol=1e-9)


def test_missing_plates_are_zero(standing):
    found = sensor_frames(capture(standing), ("C7", "T10"), plates=2, settings=CONDITIONING)
    assert found.raw_force_plate_force.shape == (10, 6)
    np.testing.assert_array_equal(found.raw_force_plate_force[:, 3:], 0.0)
    np.testing.assert_array_equal(found.raw_force_plate_cop[:, 3:], 0.0)


def test_a_faster_plate_that_starts_late():
    times = 0.03 + np.arange(200) / 1000
    force = np.column_stack([0 * times, 500 + 100 * times, 0 * times])
    late = plate(force, np.tile([0.1, 0.0, 0.2], (200, 1)), rate=1000.0, start=0.03)
    found = sensor_frames(capture(late), ("C7", "T10"), plates=1, settings=CONDITIONING)
    assert np.isnan(found.raw_force_plate_force[:3]).all()
    np.testing.assert_allclose(found.raw_force_plate_force[4:, 1], (500 + 100 * TIMES)[4:], rtol=1e-3)


def test_corners_known_and_unknown(standing):
    square = np.arange(12.0).reshape(4, 3)
    known = plate(standing.force_ground, standing.cop_ground, corners_ground=square)
    found = trial_header(capture(known, standing)).force_plate_corners
    np.testing.assert_array_equal(found[:12], square.reshape(-1))
    assert np.isnan(found[12:]).all()
    assert len(found) == 24


def test_names_of_all_trials():
    other = Markers(("T10", "LASI"), np.zeros((10, 2, 3)), RATE)
    assert marker_names([capture(), capture(markers=other)]) == ("C7", "T10", "LASI")
