"""Errors frame by frame, of answers that are made whole, and standard deviations that hold for others."""

import math
from dataclasses import replace

import numpy as np
import pytest

from addb_viewer.benchmark.averages import average
from addb_viewer.benchmark.scoring import (
    EDGES_N_PER_KG,
    WholeAnswer,
    centre_of_pressure,
    completed,
    error_bands,
    frame_errors,
    phases_of,
    scored_frames,
    scores_of,
)
from addb_viewer.benchmark.task import BenchmarkError, Measured, Predicted
from solver.contact.wrenches import FrameMask
from solver.dynamics.inverse_dynamics import inverse_dynamics
from solver.dynamics.settings import DynamicsSettings
from solver.kinematics.motion import Motion
from tests.addb_viewer.benchmark.simulated_release import GRAVITY, NAMES, RATE, example, truth
from tests.contacts import contacts_of


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
    contacts = contacts_of(NAMES, wrench, in_contact=force[..., 1] > 20)
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


DOFS = 8  # six of the root, two below


class Named:
    dofs = ("tx", "ty", "tz", "a", "b", "c", "knee", "ankle")


def pair(frames=3, seed=0):
    """Random measured values and a random answer."""
    rng = np.random.default_rng(seed)

    def feet(scale=1.0):
        return scale * rng.standard_normal((frames, 2, 3))

    force = np.abs(feet(300.0)) + 60.0
    measured = Measured(
        counts=np.ones(frames, dtype=bool),
        phase=np.full(frames, 3),
        activity=np.array(["walk"] * frames, dtype=object),
        mass_kg=70.0,
        force=force,
        moment=feet(20.0),
        foot_ground=feet(0.3),
        cop_ground=feet(0.3),
        com_acceleration=rng.standard_normal((frames, 3)),
        torque=rng.standard_normal((frames, DOFS)),
    )
    answer = WholeAnswer(
        force=np.abs(feet(300.0)) + 60.0,
        moment=feet(20.0),
        foot_ground=measured.foot_ground + feet(0.02),
        acceleration=rng.standard_normal((frames, DOFS)),
        com_acceleration=rng.standard_normal((frames, 3)),
        torque=rng.standard_normal((frames, DOFS)),
        remainder=rng.standard_normal((frames, DOFS)),
        root_dofs=(0, 1, 2, 3, 4, 5),
        force_sd=np.abs(feet(50.0)) + 1.0,
    )
    return measured, answer


def test_three_frames_by_hand():
    measured, answer = pair()
    still = np.zeros((3, 2, 3))
    answer = replace(
        answer, force=measured.force.copy(), moment=measured.moment, foot_ground=measured.foot_ground
    )
    answer.force[1, 0] += (3.0, 4.0, 0.0)  # 5 N on one of two feet
    answer = replace(answer, com_acceleration=measured.com_acceleration + np.outer([1, 0, 0], [0, 0, 2.0]))
    torque = measured.torque.copy()
    torque[2, 6], torque[2, 0] = torque[2, 6] + 7.0, torque[2, 0] + 100.0
    errors = frame_errors(measured, replace(answer, torque=torque), Named)
    np.testing.assert_allclose(errors["grf"], [0, 2.5 / 70, 0], atol=1e-12)
    np.testing.assert_allclose(errors["grf_vertical"], [0, 2.0 / 70, 0], atol=1e-12)
    np.testing.assert_allclose(errors["grf_total"], [0, 5.0 / 70, 0], atol=1e-12)
    np.testing.assert_allclose(errors["com_acc"], [2, 0, 0], atol=1e-12)
    np.testing.assert_allclose(errors["torque"], [0, 0, 3.5 / 70], atol=1e-12)
    np.testing.assert_allclose(errors["torque_with_root"], [0, 0, 107 / 8 / 70], atol=1e-12)
    np.testing.assert_allclose(errors["torque:knee"], [0, 0, 0.1], atol=1e-12)
    np.testing.assert_allclose(errors["grm"], still[:, 0, 0], atol=1e-12)


def test_against_loops():
    measured, answer = pair(frames=7, seed=1)
    errors = frame_errors(measured, answer, Named)
    for t in range(7):
        grm = grf = vertical = 0.0
        for k in range(2):
            lever = answer.foot_ground[t, k] - measured.foot_ground[t, k]
            f = answer.force[t, k]
            turned = (
                lever[1] * f[2] - lever[2] * f[1],
                lever[2] * f[0] - lever[0] * f[2],
                lever[0] * f[1] - lever[1] * f[0],
            )
            grm += math.dist([answer.moment[t, k, i] + turned[i] for i in range(3)], measured.moment[t, k])
            grf += math.dist(f, measured.force[t, k])
            vertical += abs(f[1] - measured.force[t, k, 1])
        off = [[answer.force[t, k, i] - measured.force[t, k, i] for i in range(3)] for k in range(2)]
        total = math.hypot(*(off[0][i] + off[1][i] for i in range(3)))
        by_force = [answer.force[t, 0, i] + answer.force[t, 1, i] for i in range(3)]
        by_force = [by_force[i] / 70 - (9.80665 if i == 1 else 0) for i in range(3)]
        torque = sum(abs(answer.torque[t, d] - measured.torque[t, d]) for d in (6, 7)) / 2
        inside = sum(abs(off[k][i]) < 1.959964 * answer.force_sd[t, k, i] for k in range(2) for i in range(3))
        wanted = {
            "grm": grm / 2 / 70,
            "grf": grf / 2 / 70,
            "grf_vertical": vertical / 2 / 70,
            "grf_total": total / 70,
            "grf_stacked": math.hypot(*off[0], *off[1]) / 70,
            "com_acc": math.dist(answer.com_acceleration[t], measured.com_acceleration[t]),
            "com_acc_by_force": math.dist(by_force, measured.com_acceleration[t]),
            "torque": torque / 70,
            "coverage_95": inside / 6,
        }
        for name, value in wanted.items():
            assert errors[name][t] == pytest.approx(value, abs=1e-9), name


def test_density_is_the_gaussian_one():
    from scipy.stats import norm

    measured, answer = pair(seed=2)
    density = -norm.logpdf(answer.force, measured.force, answer.force_sd).mean(axis=(1, 2))
    np.testing.assert_allclose(frame_errors(measured, answer, Named)["nll"], density)


def test_the_centre_of_pressure_is_where_the_force_was_put():
    rng = np.random.default_rng(5)
    origin, at = rng.standard_normal((2, 4, 2, 3))
    force = rng.standard_normal((4, 2, 3)) * 50 + (0, 500, 0)
    free = rng.standard_normal((4, 2))
    moment = np.cross(at - origin, force)
    moment[..., 1] += free
    found, left = centre_of_pressure(force, moment, origin, at[..., 1])
    np.testing.assert_allclose(found, at, atol=1e-9)
    np.testing.assert_allclose(left, free, atol=1e-9)


def test_pressure_is_compared_only_where_both_carry():
    measured, answer = pair()
    measured.force[0, :, 1] = 10.0
    answer.force[1, :, 1] = 10.0
    errors = frame_errors(measured, answer, Named)
    assert np.isnan(errors["cop"]).tolist() == [True, True, False]
    assert np.isnan(errors["free_moment"]).tolist() == [True, True, False]


def test_phases():
    force = np.zeros((4, 2, 3))
    force[1, 0, 1] = force[2, 1, 1] = 30.0
    force[3, :, 1] = 30.0
    assert phases_of(force).tolist() == [0, 1, 2, 3]


def test_a_scored_frame_has_half_a_second_behind_it():
    counts = np.ones(120, dtype=bool)
    counts[60] = False
    scored = scored_frames(counts)
    wanted = [bool(t >= 45 and all(counts[t - back] for back in range(0, 50, 5))) for t in range(120)]
    assert scored.tolist() == wanted
    assert scored.sum() == 120 - 45 - 10


def test_means_are_over_the_activitys_scored_frames():
    one = example()
    one.measured.activity[100:] = "stand"
    half = Predicted(0.5 * one.measured.force, 0.5 * one.measured.moment)
    by = {(s.activity, s.metric): s for s in scores_of(one, half)}
    norms = np.linalg.norm(one.measured.force, axis=2).mean(axis=1) / 2 / one.measured.mass_kg
    assert by["walk", "grf"].frames == 55
    assert by["walk", "grf"].mean == pytest.approx(norms[45:100].mean())
    assert by["stand", "grf"].mean == pytest.approx(norms[100:].mean())
    one.measured.activity[:] = "walk"


LEVEL, VERTICAL = 0.4, 1.1  # [N/kg] where a foot carries; a tenth of it where it does not


class Noisy:
    """The truth with Gaussian errors of known size."""

    def __init__(self, seed):
        self.rng = np.random.default_rng(seed)

    def answer(self, seen):
        force = example().measured.force
        loaded = force[..., 1:2] > 1.0 * seen.mass_kg
        size = np.where(loaded, 1.0, 0.1) * (LEVEL, VERTICAL, LEVEL) * seen.mass_kg
        return Predicted(force + size * self.rng.standard_normal(force.shape), np.zeros_like(force))


@pytest.fixture(scope="module")
def persons():
    return [replace(example(), person_id=f"lab/p{k}") for k in range(30)]


def test_they_are_the_root_mean_square_errors_of_each_bin(persons):
    first, again, squares = Noisy(1), Noisy(1), {}
    bands = error_bands(lambda one: first.answer(one.seen), persons[:3])
    for one in persons[:3]:
        told = again.answer(one.seen).force
        for t in range(45, one.seen.frames):
            for foot in (0, 1):
                at = sum(told[t, foot, 1] / one.seen.mass_kg > edge for edge in EDGES_N_PER_KG)
                off = (told[t, foot] - one.measured.force[t, foot]) / one.measured.mass_kg
                squares.setdefault((at, one.person_id), []).append(off**2)
    for at in range(len(EDGES_N_PER_KG) + 1):
        own = [np.mean(rows, axis=0) for (k, _), rows in squares.items() if k == at]
        frames = sum(len(rows) for (k, _), rows in squares.items() if k == at)
        if frames >= 20:
            x, y, z = np.mean(own, axis=0)
            np.testing.assert_allclose(bands.sd[at], [np.sqrt((x + z) / 2), np.sqrt(y)])


def test_gaussian_errors_of_other_persons_lie_within_them_as_often_as_is_said(persons):
    first, other, scores = Noisy(2), Noisy(3), []
    bands = error_bands(lambda one: first.answer(one.seen), persons)
    for one in persons:
        told = other.answer(one.seen)
        scores += scores_of(one, replace(told, force_sd=bands.of(told.force, one.seen.mass_kg)))
    assert average(scores, "coverage_50").mean == pytest.approx(0.50, abs=0.06)
    assert average(scores, "coverage_95").mean == pytest.approx(0.95, abs=0.02)


def test_without_measured_forces_there_are_none(persons):
    one = persons[0]
    hidden = replace(one.measured, counts=np.zeros(one.seen.frames, dtype=bool))
    assert error_bands(lambda shown: Noisy(4).answer(shown.seen), [replace(one, measured=hidden)]) is None
