"""A file of the dataset's own makers, kept to the byte and meaning what ours mean; a real walk of ours."""

from dataclasses import replace

import numpy as np
import pytest

from solver.capture.formats.b3d.b3d_file import read_b3d, write_b3d
from solver.dynamics.root_wrench import centre_of_mass
from solver.export.b3d.from_fit import fit_to_b3d
from solver.export.b3d.pass_frames import dofs_in_order, unlocked
from solver.skeleton.forward import ForwardKinematics
from solver.skeleton.osim import load_skeleton
from solver.skeleton.pinocchio_model import RigidBodyModel

pytestmark = pytest.mark.real


@pytest.fixture
def sample(real_data):
    path = real_data / "b3d" / "results.b3d"
    if not path.is_file():
        pytest.skip(f"{path} is not there")
    return path


@pytest.fixture
def model(sample, tmp_path):
    text = read_b3d(sample).header.passes[0].model_osim_text
    (tmp_path / "model.osim").write_text(text, encoding="utf-8")
    return load_skeleton(tmp_path / "model.osim")


def inner(frames):
    """All series without the first and last frame, where that file's accelerations are zero."""
    return {name: np.array(array)[1:-1] for name, array in vars(frames).items() if name != "unknown"}


def test_read_and_written_it_is_the_same_file(sample, tmp_path, same):
    b3d = read_b3d(sample)
    write_b3d(b3d, tmp_path / "again.b3d")
    assert (tmp_path / "again.b3d").read_bytes() == sample.read_bytes()
    again = read_b3d(tmp_path / "again.b3d")
    same(again.header, b3d.header)
    for one, other in zip(again.trials, b3d.trials, strict=True):
        same(one, other)


def test_what_it_holds(sample):
    b3d = read_b3d(sample)
    assert (b3d.header.num_dofs, b3d.header.mass_kg, len(b3d.header.marker_name)) == (33, 68.0, 52)
    assert [(t.header.name, t.header.trial_length) for t in b3d.trials] == [
        ("walking2_segment_0", 132),
        ("walking1_segment_0", 131),
    ]
    assert b3d.trials[1].passes[0].pos.shape == (131, 33)
    assert not b3d.header.unknown


def test_plates_add_up_to_the_contact_wrenches(sample):
    """Moments of plates are about their centres of pressure, those of contacts about the ground origin."""
    for trial in read_b3d(sample).trials:
        shape = (trial.header.trial_length, -1, 3)
        cop, torque, force = (
            np.array(getattr(trial.sensors, f"raw_force_plate_{kind}")).reshape(shape)
            for kind in ("cop", "torque", "force")
        )
        of_plates = np.concatenate([torque + np.cross(cop, force), force], axis=2).sum(axis=1)
        of_bodies = np.array(trial.passes[0].ground_contact_wrench).reshape(shape[0], -1, 6).sum(axis=1)
        np.testing.assert_allclose(of_plates, of_bodies, atol=1e-9)


def test_its_model_moves_as_ours_does(sample, model):
    """Degrees of freedom in our order, locked ones among them: then the centre of mass is where it says."""
    for trial in read_b3d(sample).trials:
        frames = inner(trial.passes[0])
        q = frames["pos"][:, [dofs_in_order(model).index(name) for name in unlocked(model).dofs]]
        com = centre_of_mass(model, ForwardKinematics(unlocked(model)).poses(q))
        np.testing.assert_allclose(com, frames["com_pos"], atol=0.002)  # they leave out the patellae


def test_its_derivatives_and_residuals(sample):
    """As the page on exports says: backward differences, no gravity in the acceleration, names exchanged."""
    for trial in read_b3d(sample).trials:
        frames, about = inner(trial.passes[0]), trial.header.processing_pass_header[0]
        com, dt = frames["com_pos"], trial.header.trial_timestep
        np.testing.assert_allclose(frames["com_vel"][1:], np.diff(com, axis=0) / dt, atol=0.02)
        off = frames["com_acc"][1:-1] - np.diff(com, 2, axis=0) / dt**2
        assert np.median(np.abs(off)) < 0.2
        for residual, part in ((about.linear_residual, slice(3)), (about.angular_residual, slice(3, 6))):
            np.testing.assert_allclose(
                residual[1:-1], np.linalg.norm(frames["tau"][:, part], axis=1), rtol=1e-6
            )
            assert residual[[0, -1]].tolist() == [0, 0]
        np.testing.assert_allclose(
            about.joints_max_velocity[1:-1], np.abs(frames["vel"]).max(axis=1), rtol=1e-6
        )


def test_its_torques_are_ours(sample, model):
    """With gravity along −z, as that file had it; above the legs, whose patellae it lacks, to the digit."""
    skeleton = replace(unlocked(model), gravity=np.array([0.0, 0.0, -9.81]))
    dofs = dofs_in_order(model)
    order = [dofs.index(name) for name in skeleton.dofs]
    for trial in read_b3d(sample).trials:
        frames = inner(trial.passes[0])
        wrenches = frames["ground_contact_wrench"].reshape(len(frames["pos"]), -1, 6)
        ours = RigidBodyModel(skeleton).inverse_dynamics(
            *(frames[name][:, order] for name in ("pos", "vel", "acc")),
            np.concatenate([wrenches[..., 3:], wrenches[..., :3]], axis=2),
            [skeleton.body_index(name) for name in ("calcn_r", "calcn_l")],
        )
        theirs = frames["tau"][:, order]
        above = [skeleton.dofs.index(name) for name in skeleton.dofs if name.startswith(("lumbar", "arm"))]
        np.testing.assert_allclose(ours[:, above], theirs[:, above], atol=1e-4)
        np.testing.assert_allclose(ours, theirs, atol=20.0)
        assert np.abs(theirs).max() > 1000


@pytest.mark.slow
def test_our_walk_obeys_newton_and_the_review(recorded_fit, tmp_path):
    fit = recorded_fit("walk_rajagopal2015")
    write_b3d(fit_to_b3d(fit), tmp_path / "walk.b3d")
    b3d = read_b3d(tmp_path / "walk.b3d")
    (trial,) = b3d.trials
    counted = np.flatnonzero(np.array(trial.header.missing_GRF_reason) == 0)
    assert (counted[0], counted[-1], len(counted)) == (61, 174, 114)
    assert set(np.delete(trial.header.missing_GRF_reason, counted)) == {10}
    for frames, about in zip(trial.passes, trial.header.processing_pass_header, strict=True):
        force = frames.ground_contact_force.reshape(-1, 2, 3).sum(axis=1)
        missing = np.linalg.norm(b3d.header.mass_kg * frames.com_acc - force, axis=1)
        np.testing.assert_allclose(missing[1:-1], about.linear_residual[1:-1], rtol=1e-4)
        in_root = np.linalg.norm(frames.root_frame_residual[:, 3:], axis=1)
        np.testing.assert_allclose(in_root, missing, rtol=1e-6)
        observed = np.array(trial.sensors.marker_obs).reshape(238, -1, 3)
        knee = frames.world_frame_joint_centers.reshape(238, -1, 3)[:, 2]
        beside_it = observed[:, b3d.header.marker_name.index("R.Knee")]
        assert np.linalg.norm(beside_it - knee, axis=1).max() < 0.1
    plates = np.array(trial.sensors.raw_force_plate_force).reshape(238, -1, 3)[counted].sum(axis=1)
    assert np.median(plates[:, 1]) == pytest.approx(9.81 * b3d.header.mass_kg, rel=0.1)
