"""An answer made whole obeys Newton's law and the equation of motion."""

from dataclasses import replace

import numpy as np
import pytest

from addb_viewer.benchmark.scoring import completed
from addb_viewer.benchmark.task import BenchmarkError, Predicted
from solver.contact.wrenches import ContactWrenches, FrameMask
from solver.dynamics.inverse_dynamics import inverse_dynamics
from solver.dynamics.settings import DynamicsSettings
from solver.kinematics.motion import Motion
from tests.addb_viewer.benchmark.simulated_release import GRAVITY, NAMES, RATE, example, truth


@pytest.fixture(scope="module")
def walk():
    return example()


def test_the_centre_of_mass_obeys_the_forces(walk):
    rng = np.random.default_rng(0)
    force = walk.measured.force + 40 * rng.standard_normal(walk.measured.force.shape)
    whole = completed(walk.seen, Predicted(force, walk.measured.moment))
    wanted = force.sum(axis=1) / walk.seen.mass_kg + GRAVITY
    np.testing.assert_allclose(whole.com_acceleration, wanted, atol=1e-9)
    # Where F = m a holds, nothing is left for the translations of the root.
    np.testing.assert_allclose(whole.torque[:, list(whole.root_dofs[:3])], 0.0, atol=1e-6)
    assert np.abs(whole.torque[:, list(whole.root_dofs[3:])]).max() > 1.0
    assert not whole.remainder.any()


def test_torques_are_those_of_the_solvers_inverse_dynamics(walk):
    skeleton, (q, _, _), force, moment, _, feet, _ = truth("walk")
    motion = Motion(skeleton.dofs, q, RATE)
    said = Predicted(force, moment, acceleration=motion.acceleration, velocity=motion.velocity)
    whole = completed(walk.seen, said)
    wrench = np.concatenate([force, moment + np.cross(feet, force)], axis=2)
    contacts = ContactWrenches(
        NAMES,
        wrench,
        cop_ground=np.full((len(q), 2, 3), np.nan),
        observed=np.ones(len(q), dtype=bool),
        in_contact=force[..., 1] > 20,
        plate=np.zeros((len(q), 0), dtype=int),
        wrench_raw_ground=wrench,
    )
    everything = FrameMask(np.ones((len(q), 2), bool))
    solved = inverse_dynamics(skeleton, motion, contacts, everything, DynamicsSettings())
    np.testing.assert_allclose(whole.torque, solved.joint_torques, atol=1e-6)
    root = list(whole.root_dofs[:3])
    assert np.linalg.norm(whole.torque[:, root], axis=1).max() == pytest.approx(
        np.linalg.norm(solved.residual_root[:, :3], axis=1).max(), rel=1e-6
    )


def test_what_an_answer_leaves_of_the_equation_is_told(walk):
    _, (_, v, a), force, moment, _, _, torque = truth("walk")
    said = Predicted(force, moment, acceleration=a, velocity=v, torque=torque + 2.0)
    np.testing.assert_allclose(completed(walk.seen, said).remainder, 2.0, atol=1e-6)


def test_answers_of_the_wrong_shape_or_without_numbers_are_refused(walk):
    fine = Predicted(walk.measured.force, walk.measured.moment)
    with pytest.raises(BenchmarkError, match="force has shape"):
        completed(walk.seen, replace(fine, force=fine.force[:-1]))
    moment = fine.moment.copy()
    moment[7, 1, 0] = np.nan
    with pytest.raises(BenchmarkError, match="frame 7"):
        completed(walk.seen, replace(fine, moment=moment))
