"""What sound recordings may be off by, against Pinocchio and against differences."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from solver.diagnosis.noise.model_errors import (
    BOUNCE_STD,
    MODEL_ARM_M,
    MODEL_FORCE_SHARE,
    MODEL_TIME_S,
    SEGMENT_INERTIA_STD,
    SPIN_STD,
    SWAY_STD,
    TISSUE_LEAST_SHARE,
    UNWEIGHED_MASS_STD,
    model_error,
    nuisances,
    soft_tissue,
    unseen_posture,
)
from solver.dynamics.weighted_means import windows_over
from solver.fitting.diagnosis_settings import DiagnosisSettings
from solver.simulate.ground_demand import GroundDemand
from solver.simulate.other_masses import with_segment_masses
from solver.skeleton.pinocchio_model import RigidBodyModel

SETTINGS = DiagnosisSettings()
LEGS = ("pelvis", "femur", "tibia", "talus", "calcn", "toes")
ABOVE_LEGS = ("lumbar", "arm", "elbow", "pro_sup", "wrist")
PER_BODY = 9  # three of the centre of mass, six of the second moments


@dataclass(frozen=True, eq=False)
class Columns:
    """The nuisances by what they are."""

    heavy: list[int]
    all: np.ndarray
    tissue: np.ndarray

    def of_body(self, b: int) -> np.ndarray:
        first = PER_BODY * self.heavy.index(b)
        return self.all[:, first : first + PER_BODY]

    @property
    def others(self) -> np.ndarray:
        return self.all[:, PER_BODY * len(self.heavy) :]

    @property
    def masses(self) -> np.ndarray:
        return self.others[:, : len(self.heavy)]

    @property
    def bounce(self) -> np.ndarray:
        return self.others[:, len(self.heavy) :]


@pytest.fixture(scope="module")
def columns(short_scene, short_rows) -> Columns:
    heavy = [b for b, body in enumerate(short_scene.skeleton.bodies) if body.mass > 0]
    return Columns(heavy, short_rows.nuisance, short_rows.tissue)


def with_body(skeleton, b, body):
    return replace(skeleton, bodies=(*skeleton.bodies[:b], body, *skeleton.bodies[b + 1 :]))


def differences(short_rows, demands, ahead, behind, size):
    return short_rows.reduce(demands(ahead) - demands(behind)) / (2 * size)


@pytest.mark.parametrize("name", ["torso", "femur_r", "hand_l"])
def test_centres_of_mass_move_by_a_standard_deviation_and_inertia_moves_with_them(
    short_scene, short_rows, demands, columns, name
):
    skeleton = short_scene.skeleton
    b = skeleton.body_index(name)
    body, own = skeleton.bodies[b], columns.of_body(b)
    for i, axis in enumerate(np.eye(3)):
        ends = [
            with_body(skeleton, b, replace(body, com_body=body.com_body + s * 1e-4 * axis)) for s in (1, -1)
        ]
        expected = SETTINGS.segment_com_std_m * differences(short_rows, demands, *ends, 1e-4)
        np.testing.assert_allclose(own[:, i], expected, atol=1e-5 * np.abs(expected).max())


@pytest.mark.parametrize("name", ["torso", "femur_r"])
def test_second_moments_change_by_a_tenth_along_and_across_the_axes(
    short_scene, short_rows, demands, columns, name
):
    """Second moments of mass about the centre of mass; the inertia is their trace less themselves."""
    skeleton = short_scene.skeleton
    b = skeleton.body_index(name)
    body, own = skeleton.bodies[b], columns.of_body(b)[:, 3:]
    second = 0.5 * np.trace(body.inertia_body) * np.eye(3) - body.inertia_body
    for k, (i, j) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))):
        size = np.sqrt(abs(second[i, i] * second[j, j])) * SEGMENT_INERTIA_STD
        change = np.zeros((3, 3))
        change[i, j] = change[j, i] = size if i == j else size / 2
        turned = np.trace(change) * np.eye(3) - change
        ends = [
            with_body(skeleton, b, replace(body, inertia_body=body.inertia_body + s * turned))
            for s in (0.5, -0.5)
        ]
        expected = differences(short_rows, demands, *ends, 0.5)
        np.testing.assert_allclose(own[:, k], expected, atol=1e-5 * np.abs(expected).max())


def test_masses_scatter_by_themselves_but_a_scale_told_their_sum(short_scene, short_rows, demands, columns):
    """Gaussian conditioning on a reading of the sum."""
    skeleton = short_scene.skeleton
    by_mass = []
    for b in columns.heavy:
        body = skeleton.bodies[b]
        ends = [with_segment_masses(skeleton, {body.name: 1 + s * 1e-4}) for s in (1, -1)]
        by_mass.append(differences(short_rows, demands, *ends, 1e-4 * body.mass))
    H = np.stack(by_mass, axis=1)
    D = np.diag([(SETTINGS.segment_mass_std * skeleton.bodies[b].mass) ** 2 for b in columns.heavy])
    sums = D.sum(axis=1)
    reading = (SETTINGS.body_mass_std * skeleton.mass) ** 2
    C = D - np.outer(sums, sums) / (sums.sum() + reading)
    own = columns.masses
    expected = H @ C @ H.T
    np.testing.assert_allclose(own @ own.T, expected, atol=1e-6 * np.abs(expected).max())


def test_a_bounce_is_the_centre_of_masss_acceleration_along_one_axis(short_scene, short_rows, columns):
    """Second differences of the centre of mass; through it, so without a moment."""
    scene = short_scene
    acceleration = np.gradient(np.gradient(scene.com_ground, 0.01, axis=0), 0.01, axis=0)
    for axis, std in enumerate((SWAY_STD, BOUNCE_STD, SWAY_STD)):
        rows = columns.bounce[:, axis].reshape(-1, 6)
        force = np.zeros((scene.frames, 3))
        force[:, axis] = std * scene.skeleton.mass * acceleration[:, axis]
        expected = short_rows.windows.means(force)
        size = np.abs(expected).max()
        assert np.sqrt(((rows[:, :3] - expected) ** 2).mean()) < 0.05 * size
        np.testing.assert_allclose(rows[:, 3:], 0, atol=1e-9 * size)


def test_a_spin_is_the_moment_about_the_centre_of_mass_and_no_force(
    short_scene, short_rows, demands, columns
):
    """Of Pinocchio's demand, moved to the centre of mass by hand."""
    required = demands(short_scene.skeleton)
    about_com = required[:, 3:] - np.cross(short_scene.com_ground, required[:, :3])
    for axis in range(3):
        rows = columns.bounce[:, 3 + axis].reshape(-1, 6)
        moment = np.zeros_like(about_com)
        moment[:, axis] = SPIN_STD * about_com[:, axis]
        expected = short_rows.windows.means(moment)
        np.testing.assert_allclose(rows[:, 3:], expected, atol=1e-3 * np.abs(expected).max())
        np.testing.assert_allclose(rows[:, :3], 0, atol=1e-9)


def test_the_bodys_mass_changes_as_its_segments_do_when_only_their_sum_is_known_to_be_off(
    short_scene, short_rows, demands
):
    """Regression of segments on their sum: by Sherman and Morrison's formula, demands by differences."""
    skeleton = short_scene.skeleton
    variances = np.array([(SETTINGS.segment_mass_std * b.mass) ** 2 for b in skeleton.bodies])
    entered = (SETTINGS.body_mass_std * skeleton.mass) ** 2
    covariance = np.diag(variances) - np.outer(variances, variances) / (entered + variances.sum())
    change = covariance.sum(axis=1) / np.sqrt(covariance.sum())
    assert change.sum() == pytest.approx(np.sqrt(1 / (1 / entered + 1 / variances.sum())))
    ends = []
    for sign in (1, -1):
        factors = 1 + sign * 1e-4 * change / [b.mass for b in skeleton.bodies]
        bodies = tuple(
            replace(b, mass=b.mass * f, inertia_body=b.inertia_body * f)
            for b, f in zip(skeleton.bodies, factors, strict=True)
        )
        ends.append(replace(skeleton, bodies=bodies))
    expected = differences(short_rows, demands, *ends, 1e-4)
    np.testing.assert_allclose(short_rows.mass, expected, atol=1e-5 * np.abs(expected).max())


def test_soft_tissue_is_segments_displaced_with_the_angles_beside_them(short_scene, short_rows, columns):
    """Newton's law for point masses at displaced places, both differenced alike; sorted out by their span."""
    scene, skeleton = short_scene, short_scene.skeleton
    b = skeleton.body_index("femur_r")
    body = skeleton.bodies[b]
    x = scene.point_ground(b, body.com_body)
    at_rest = body.mass * (scene.material[:, b] @ np.append(body.com_body, 1.0))
    for dof in ("hip_flexion_r", "knee_angle_r"):
        angle = scene.motion.q[:, skeleton.dofs.index(dof)]
        for axis in np.eye(3):
            u = (
                SETTINGS.tissue_std_m_per_rad
                * (angle - angle.mean())[:, None]
                * (scene.R_ground_body[:, b] @ axis)
            )
            velocity = np.gradient(u, 1 / scene.rate, axis=0)
            extra = body.mass * np.gradient(velocity, 1 / scene.rate, axis=0)
            step = 1e-3
            ends = [
                np.concatenate([at_rest + s * extra, np.cross(x + s * u, at_rest + s * extra)], axis=1)
                for s in (step, -step)
            ]
            expected = short_rows.reduce((ends[0] - ends[1]) / (2 * step))
            distance = np.abs(columns.tissue - expected[:, None]).max(axis=0)
            assert distance.min() < 1e-6 * np.abs(expected).max()


def test_every_heavy_segment_slides_along_three_axes_with_each_angle_beside_it(short_scene, columns):
    skeleton = short_scene.skeleton
    expected = 0
    for b, body in enumerate(skeleton.bodies):
        if body.mass < TISSUE_LEAST_SHARE * skeleton.mass:
            continue
        beside = [j for c, j in enumerate(skeleton.joints) if j.parent >= 0 and b in {c, j.parent}]
        turns = {a.coordinate for j in beside for a in j.axes if a.kind == "rotation"}
        expected += 3 * len(turns & set(skeleton.dofs))
    assert expected > 0
    assert columns.tissue.shape[1] == expected


def test_trials_have_the_same_nuisances_in_the_same_order(short_scene, short_rows):
    """They are shared: a part of the trial has as many."""
    ends = slice(0, 80)
    part = replace(
        short_scene,
        motion=replace(short_scene.motion, q=short_scene.motion.q[ends]),
        R_ground_body=short_scene.R_ground_body[ends],
        p_ground_body=short_scene.p_ground_body[ends],
        material=short_scene.material[ends],
        com_ground=short_scene.com_ground[ends],
        required_ground=short_scene.required_ground[ends],
    )
    for columns, whole in ((nuisances, short_rows.nuisance), (soft_tissue, short_rows.tissue)):
        own = columns(part, lambda w: w.reshape(-1, *w.shape[2:]), SETTINGS)
        assert own.shape[1] == whole.shape[1]


def test_model_errors_fade_with_time_and_grow_with_the_acceleration(short_scene):
    windows = windows_over(np.ones(short_scene.frames, dtype=bool), 100.0, 0.06, 0.06)
    K = model_error(short_scene, windows).reshape(windows.count, 6, windows.count, 6)
    weight = short_scene.weight_N
    assert K[3, 3, 3, 3] == pytest.approx((MODEL_ARM_M * weight) ** 2)
    assert np.sqrt(K[0, 1, 0, 1]) > MODEL_FORCE_SHARE * weight
    assert K[4, 1, 5, 1] / K[4, 1, 4, 1] == pytest.approx(np.exp(-0.5 * (0.06 / MODEL_TIME_S) ** 2))
    assert np.abs(K[:, 0, :, 1]).max() == 0
    still = replace(
        short_scene, required_ground=np.tile([0, weight, 0, 0, 0, 0], (short_scene.frames, 1)).astype(float)
    )
    quiet = model_error(still, windows).reshape(windows.count, 6, windows.count, 6)
    assert np.sqrt(quiet[0, 1, 0, 1]) == pytest.approx(MODEL_FORCE_SHARE * weight, rel=1e-3)


def test_joints_that_no_marker_shows_may_stand_at_any_angle_near(short_scene, short_rows):
    """Their demands by Pinocchio, to and fro; plates read nearly what the whole motion demands."""
    skeleton, markers = short_scene.skeleton, short_scene.markers
    legs = [b for b, body in enumerate(skeleton.bodies) if body.name.startswith(LEGS)]
    observed = np.where(np.isin(markers.body, legs)[:, None], markers.observed_ground, np.nan)
    unseen = [j for j, dof in enumerate(skeleton.dofs) if dof.startswith(ABOVE_LEGS)]
    demand, own = GroundDemand(RigidBodyModel(skeleton)), []
    q, v, a = short_scene.motion.q, short_scene.velocity, short_scene.acceleration
    for turn in 1e-4 * np.eye(q.shape[1])[unseen]:
        own.append(short_rows.reduce(demand.wrench(q + turn, v, a) - demand.wrench(q - turn, v, a)) / 2e-4)
    expected = 0.25**2 * np.transpose(own) @ own
    bare = replace(short_scene, markers=replace(markers, observed_ground=observed))
    found = unseen_posture(bare, short_rows.windows)
    np.testing.assert_allclose(found, expected, atol=2e-3 * np.abs(expected).max())


def test_somebody_nobody_weighed_may_weigh_anything_near_with_the_same_proportions(
    short_scene, short_rows, demands
):
    """All segments heavier together, beside what segments scatter: the demand itself, once more."""
    unweighed = replace(short_scene, mass_was_entered=False)
    some = nuisances(short_scene, short_rows.reduce, SETTINGS)
    more = nuisances(unweighed, short_rows.reduce, SETTINGS)
    added = more @ more.T - some @ some.T
    whole = UNWEIGHED_MASS_STD * short_rows.reduce(demands(short_scene.skeleton))
    np.testing.assert_allclose(added, np.outer(whole, whole), atol=1e-3 * np.abs(added).max())
