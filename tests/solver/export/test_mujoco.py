"""MuJoCo itself opens the exported model, and finds bodies, centre of mass and torques as we do."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import qmc

from solver.export.mjcf import export_mujoco, mujoco_model, mujoco_motion, with_least_inertia
from solver.kinematics.motion import Motion
from solver.skeleton.functions import CubicSpline, Linear
from solver.skeleton.osim import load_skeleton
from solver.skeleton.pinocchio_model import RigidBodyModel
from solver.skeleton.skeleton import Body

mujoco = pytest.importorskip("mujoco", reason="the package mujoco is not installed; pip install .[dev]")

R_WORLD_GROUND = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
MODELS = ["LaiUhlrich2022", "Rajagopal2016", "gait2392_thelen2003muscle", "gait2354_osim23_format"]


def compare(model, skeleton, motion, qpos):
    """Largest distances: of bodies' origins and the centre of mass [m], of their axes."""
    data, ours = mujoco.MjData(model), RigidBodyModel(skeleton)
    R, p = ours.body_placements(motion.q)
    com = ours.centre_of_mass(motion.q)
    bodies = [model.body(name).id for name in skeleton.body_names]
    origin, axes, centre = 0.0, 0.0, 0.0
    for frame, pose in enumerate(qpos):
        data.qpos[:] = pose
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        origin = max(origin, np.abs(data.xpos[bodies] - p[frame] @ R_WORLD_GROUND.T).max())
        axes = max(axes, np.abs(data.xmat[bodies].reshape(-1, 3, 3) - R_WORLD_GROUND @ R[frame]).max())
        centre = max(centre, np.abs(data.subtree_com[0] - R_WORLD_GROUND @ com[frame]).max())
    return origin, axes, centre


def torques(model, skeleton, written, arrays):
    """MuJoCo's inverse dynamics without equalities, as generalized forces of the skeleton's coordinates."""
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    data, ours = mujoco.MjData(model), RigidBodyModel(skeleton).chain
    found = np.zeros((len(arrays["qpos"]), len(skeleton.dofs)))
    _, slope, _ = ours.couple(arrays["q"])
    for frame, row in enumerate(found):
        data.qpos[:], data.qvel[:], data.qacc[:] = (arrays[name][frame] for name in ("qpos", "qvel", "qacc"))
        mujoco.mj_inverse(model, data)
        positions = list(written.positions)
        np.add.at(row, ours.dof[positions], written.signs * data.qfrc_inverse * slope[frame, positions])
    return found


def test_the_exported_files_reproduce_the_motion(fit, tmp_path):
    written, notes = export_mujoco(fit, tmp_path / "results" / "mujoco")
    folder = tmp_path / "results" / "mujoco"
    assert written[0] == folder / "model.xml"
    assert written[-1] == folder / "walk_motion.npz"
    assert {path.parent for path in written[1:-1]} == {folder / "model_bones"}
    model = mujoco.MjModel.from_xml_path(str(folder / "model.xml"))
    motion = fit.trials[0].dynamics.motion
    with np.load(folder / "walk_motion.npz") as arrays:
        assert [model.joint(k).name for k in range(model.njnt)] == list(arrays["joints"])
        np.testing.assert_allclose(arrays["time"], motion.times)
        assert max(compare(model, fit.skeleton, motion, arrays["qpos"])) < 1e-9
    assert any("polynomials" in note for note in notes)


def test_coupled_coordinates_are_joints_of_their_own_and_locked_ones_are_none(fit, tmp_path):
    export_mujoco(fit, tmp_path)
    q, dofs = fit.trials[0].motion.q, fit.skeleton.dofs
    with np.load(tmp_path / "walk_motion.npz") as arrays:
        columns = dict(zip(arrays["joints"], arrays["qpos"].T, strict=True))
    for name in dofs:
        np.testing.assert_allclose(columns[name], q[:, dofs.index(name)], err_msg=name)
    knee = q[:, dofs.index("knee_angle")]
    np.testing.assert_allclose(columns["knee_translation1"], 0.02 * knee**2 - 0.03 * knee, atol=1e-12)
    assert "locked_angle" not in columns
    assert len(columns) == len(dofs) + 2  # the knee's translation, and its cap


def test_equalities_hold_what_follows_another_coordinate(fit, tmp_path):
    """The crane's couplings are polynomials, so MuJoCo finds them kept on every frame."""
    export_mujoco(fit, tmp_path)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "model.xml"))
    data = mujoco.MjData(model)
    with np.load(tmp_path / "walk_motion.npz") as arrays:
        poses = arrays["qpos"]
    assert model.neq == 2
    for pose in poses[::10]:
        data.qpos[:] = pose
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(data.efc_pos[: data.ne], 0.0, atol=1e-9)
    data.qpos[model.joint("knee_angle").qposadr] += 0.3
    mujoco.mj_forward(model, data)
    assert np.abs(data.efc_pos[: data.ne]).max() > 0.01


def test_velocities_and_accelerations_give_our_inverse_dynamics(crane, crane_q):
    motion, written = Motion(crane.dofs, crane_q, 50.0), mujoco_model(crane, {}, "bones")
    arrays = {**mujoco_motion(crane, written, motion), "q": motion.q}
    expected = RigidBodyModel(crane).inverse_dynamics(motion.q, motion.velocity, motion.acceleration)
    found = torques(mujoco.MjModel.from_xml_string(written.xml), crane, written, arrays)
    assert not any("minimum inertia" in note for note in written.notes)
    assert np.abs(expected).max() > 50
    np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())


def test_a_coordinate_that_turns_the_other_way_keeps_its_sign(crane, crane_q):
    arm = next(
        k for k, joint in enumerate(crane.joints) if joint.axes and joint.axes[-1].coordinate == "arm_angle"
    )
    axes = tuple(replace(axis, function=Linear(-1.0, 0.0)) for axis in crane.joints[arm].axes)
    joints = (*crane.joints[:arm], replace(crane.joints[arm], axes=axes), *crane.joints[arm + 1 :])
    turned, motion = replace(crane, joints=joints), Motion(crane.dofs, crane_q, 50.0)
    written = mujoco_model(turned, {}, "bones")
    arrays = mujoco_motion(turned, written, motion)
    column = arrays["qpos"][:, written.joints.index("arm_angle")]
    np.testing.assert_allclose(column, crane_q[:, crane.dofs.index("arm_angle")])
    model = mujoco.MjModel.from_xml_string(written.xml)
    assert max(compare(model, turned, motion, arrays["qpos"])) < 1e-9


def test_bodies_without_mass_get_a_minimum_inertia_and_are_listed(crane, crane_q):
    bodies = list(crane.bodies)
    bodies[2] = replace(bodies[2], mass=0.0, inertia_body=np.zeros((3, 3)))
    light = replace(crane, bodies=tuple(bodies))
    written, motion = mujoco_model(light, {}, "bones"), Motion(crane.dofs, crane_q, 50.0)
    (note,) = (note for note in written.notes if "minimum inertia" in note)
    assert f"{bodies[2].name}: mass 0 to 1e-06 kg" in note
    assert bodies[1].name not in note
    qpos = mujoco_motion(light, written, motion)["qpos"]
    assert max(compare(mujoco.MjModel.from_xml_string(written.xml), light, motion, qpos)) < 1e-6


def test_moments_that_no_rigid_body_has_are_raised_no_more_than_needed():
    turn = np.linalg.qr(np.array([[1.0, 2, 3], [0, 1, 4], [5, 6, 0]]))[0]
    body = Body("toes", 0.2, np.zeros(3), turn @ np.diag([0.1, 0.2, 1.0]) @ turn.T)
    raised, change = with_least_inertia(body)
    np.testing.assert_allclose(np.linalg.eigvalsh(raised.inertia_body), [0.45, 0.55, 1.0])
    assert "0.1 0.2 1 to 0.45 0.55 1" in change
    sound = replace(body, inertia_body=turn @ np.diag([0.5, 0.6, 1.0]) @ turn.T)
    assert with_least_inertia(sound) == (sound, "")


def test_the_deviation_of_the_polynomials_is_told_and_true(crane, crane_q):
    """A knee that slides along a spline: MuJoCo's own constraint error is no larger than the note says."""
    spline = CubicSpline((-2.0, -1.0, 0.0, 0.3, 1.0), (0.03, 0.01, 0.0, 0.02, -0.04))
    knee = next(k for k, joint in enumerate(crane.joints) if joint.name == "knee")
    axes = (replace(crane.joints[knee].axes[0], function=spline), *crane.joints[knee].axes[1:])
    joints = (*crane.joints[:knee], replace(crane.joints[knee], axes=axes), *crane.joints[knee + 1 :])
    bent = replace(crane, joints=joints)
    written = mujoco_model(bent, {}, "bones")
    (note,) = (note for note in written.notes if "polynomials" in note)
    told = float(note.split("at most ")[1].split(" m ")[0])
    low, high = next(c.range for c in bent.coordinates if c.name == "knee_angle")
    low, high = max(low, -np.pi), min(high, np.pi)
    q = np.tile(bent.default_q, (300, 1))
    q[:, bent.dofs.index("knee_angle")] = np.linspace(low, high, 300)
    model = mujoco.MjModel.from_xml_string(written.xml)
    data, worst = mujoco.MjData(model), 0.0
    for pose in mujoco_motion(bent, written, Motion(bent.dofs, q, 100.0))["qpos"]:
        data.qpos[:] = pose
        mujoco.mj_forward(model, data)
        worst = max(worst, np.abs(data.efc_pos[: data.ne]).max())
    assert told == pytest.approx(worst, rel=0.06)
    assert told > 1e-3


@pytest.mark.real
def test_a_recorded_walk_on_moving_knees(recorded_walk):
    """Its toes' moments are no rigid body's, so both get those that MuJoCo takes."""
    skeleton, motion = recorded_walk
    skeleton = replace(skeleton, bodies=tuple(with_least_inertia(body)[0] for body in skeleton.bodies))
    written = mujoco_model(skeleton, {}, "bones")
    arrays = {**mujoco_motion(skeleton, written, motion), "q": motion.q}
    model = mujoco.MjModel.from_xml_string(written.xml)
    assert max(compare(model, skeleton, motion, arrays["qpos"])) < 1e-9
    expected = RigidBodyModel(skeleton).inverse_dynamics(motion.q, motion.velocity, motion.acceleration)
    found = torques(model, skeleton, written, arrays)
    np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())


@pytest.mark.real
@pytest.mark.parametrize("name", MODELS)
def test_published_models_anywhere_in_their_ranges(name, real_data):
    skeleton = load_skeleton(real_data / "models" / f"{name}.osim")
    low, high = np.array([c.range for c in skeleton.free_coordinates]).T
    low, high = np.maximum(low, -np.pi), np.minimum(high, np.pi)
    q = qmc.scale(qmc.Sobol(len(low), seed=5).random(64), np.minimum(low, high - 1e-6), high)
    motion, written = Motion(skeleton.dofs, q, 100.0), mujoco_model(skeleton, {}, "bones")
    model = mujoco.MjModel.from_xml_string(written.xml)
    assert max(compare(model, skeleton, motion, mujoco_motion(skeleton, written, motion)["qpos"])) < 1e-6
