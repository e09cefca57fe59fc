"""Forces that no cause of the catalogue describes: where they act, and on what they depend."""

from dataclasses import replace

import numpy as np
import pytest

from solver.diagnosis.causes.observed_trial import force_at
from solver.diagnosis.conclusion import conclude
from solver.diagnosis.diagnosis import UNEXPLAINED
from solver.diagnosis.search.selection import select
from solver.diagnosis.unmodelled.remainder import (
    KNOTS_S,
    UnknownForce,
    UnknownMoment,
    dependence,
    strongest_frequency_Hz,
    unknown_forces,
)

POINT = np.array([0.02, -0.03, 0.01])  # from the body's centre of mass [m]


@pytest.fixture(scope="module")
def pulled(short_scene):
    """The wrench of a force that swells and fades, at a point of a body."""

    def wrench(name: str, force: list[float]) -> np.ndarray:
        b = short_scene.skeleton.body_index(name)
        point = short_scene.point_ground(b, short_scene.skeleton.bodies[b].com_body + POINT)
        swelling = 0.5 + np.sin(np.pi * short_scene.times / short_scene.times[-1]) ** 2
        return force_at(np.array(force) * swelling[:, None], point)

    return wrench


@pytest.mark.parametrize(("name", "force"), [("hand_l", [60.0, 0.0, 15.0]), ("torso", [40.0, 0.0, 10.0])])
def test_a_force_is_found_on_the_body_where_it_acts(drawn, balance_of_scenes, pulled, name, force):
    """A hand hangs beside the thigh: of ten draws 40 N are told of it in seven, 60 N in nine."""
    missing = pulled(name, force)
    balance = balance_of_scenes(drawn(2, missing, scale=0.5))
    diagnosis = conclude(balance, select(balance, []))
    where = diagnosis.remaining.location
    assert diagnosis.verdict == UNEXPLAINED
    assert diagnosis.effects == ()
    assert where.body == name
    np.testing.assert_allclose(where.mean_force_N, missing[:, :3].mean(axis=0), atol=8.0)
    rms = np.sqrt((missing[:, :3] ** 2).sum(axis=1).mean())
    assert where.rms_force_N == pytest.approx(rms, rel=0.15)
    assert where.depends_on.startswith("constant")


def test_what_swings_evenly_is_found_and_said_to(drawn, short_scene, balance_of_scenes):
    """Five swings a second: splines wide enough for half a trial's time history would hardly follow."""
    b = short_scene.skeleton.body_index("torso")
    place = short_scene.point_ground(b, short_scene.skeleton.bodies[b].com_body)
    swing = 40.0 * np.sin(2 * np.pi * 5.0 * short_scene.times + 0.7)
    missing = force_at(np.array([0.2, 0.0, 1.0]) * swing[:, None], place)
    balance = balance_of_scenes(drawn(4, missing, scale=0.5))
    diagnosis = conclude(balance, select(balance, []))
    where = diagnosis.remaining.location
    assert diagnosis.verdict == UNEXPLAINED
    assert where.body == "torso"
    assert where.rms_force_N == pytest.approx(np.sqrt((missing[:, :3] ** 2).sum(axis=1).mean()), rel=0.15)
    assert where.depends_on == "time: it swings 5.0 times a second"


def test_what_swings_with_the_steps_and_is_small_beside_them_is_no_swing(short_scene, drawn):
    """A tenth of all that the motion demands is lacking: errors of a model, not a motor."""
    assert strongest_frequency_Hz(drawn(1, 0.1 * short_scene.required_ground)) is None
    lacking = np.zeros_like(short_scene.required_ground)
    lacking[:, 2] = 150.0 * np.cos(2 * np.pi * 6.0 * short_scene.times)
    assert strongest_frequency_Hz(drawn(1, lacking)) == pytest.approx(6.0, abs=0.2)
    lasting_s = short_scene.times[-1]
    lacking[:, 2] = 150.0 * np.cos(2 * np.pi * 1.5 / lasting_s * short_scene.times)
    assert strongest_frequency_Hz(drawn(1, lacking)) is None, "one and a half periods are no swing"
    nothing_counts = np.zeros(short_scene.frames, dtype=bool)
    assert strongest_frequency_Hz(replace(short_scene, counts=nothing_counts)) is None


def test_a_force_in_the_second_trial_of_another_length_is_found(
    short_scene, drawn, balance_of_scenes, pulled
):
    first = slice(0, 120)
    other = drawn(3, pulled("torso", [40.0, 0.0, 10.0]), scale=0.5)
    plates = tuple(
        replace(p, times=p.times[first], wrench_ground=p.wrench_ground[first], loaded=p.loaded[first])
        for p in other.plates
    )
    other = replace(
        other,
        name="another",
        motion=replace(other.motion, q=other.motion.q[first]),
        R_ground_body=other.R_ground_body[first],
        p_ground_body=other.p_ground_body[first],
        material=other.material[first],
        com_ground=other.com_ground[first],
        counts=other.counts[first],
        required_ground=other.required_ground[first],
        plates=plates,
        contacts=replace(
            other.contacts,
            **{
                name: getattr(other.contacts, name)[first]
                for name in ("wrench_ground", "cop_ground", "observed", "in_contact", "plate")
            },
        ),
    )
    balance = balance_of_scenes(drawn(2, scale=0.5), other)
    diagnosis = conclude(balance, select(balance, []))
    assert diagnosis.verdict == UNEXPLAINED
    assert diagnosis.trials == ("walk", "another")
    assert diagnosis.remaining.location.body == "torso"
    assert diagnosis.remaining.location.mean_force_N[0] == pytest.approx(40.0, rel=0.25)


def test_a_moment_has_no_place(short_scene, drawn, balance_of_scenes):
    moment = np.zeros((short_scene.frames, 6))
    moment[:, 4] = 20.0 * np.sin(np.pi * short_scene.times / short_scene.times[-1]) ** 2
    balance = balance_of_scenes(drawn(1, moment, scale=0.5))
    diagnosis = conclude(balance, select(balance, []))
    assert diagnosis.verdict == UNEXPLAINED
    assert diagnosis.remaining.location is None


def test_a_forces_point_is_where_its_moments_say(short_scene, pulled):
    """From the exact force and moments of the candidate's own splines."""
    candidate = UnknownForce("hand_l", "walk")
    b = short_scene.skeleton.body_index("hand_l")
    missing = pulled("hand_l", [10.0, -25.0, 8.0])
    signature = candidate.signature(short_scene, (0.02,))
    flat = signature.columns.reshape(-1, signature.columns.shape[2])
    x = np.linalg.lstsq(flat, missing.ravel(), rcond=1e-10)[0]
    left = flat @ x - missing.ravel()
    assert np.abs(left).max() < 0.1  # [N], [N·m]
    width = len(x) // 6
    time_histories = signature.columns[:, 0, :width]
    at_centre = time_histories @ x[: 3 * width].reshape(3, -1).T
    np.testing.assert_allclose(at_centre, missing[:, :3], atol=0.1)
    np.testing.assert_allclose(candidate.force_ground(short_scene, x), at_centre, atol=1e-9)
    point = candidate.at_its_point(short_scene, x).point_body
    np.testing.assert_allclose(point, short_scene.skeleton.bodies[b].com_body + POINT, atol=0.003)


def test_a_known_point_leaves_no_free_moment(short_scene):
    point = (0.0, -0.05, 0.0)
    candidate = UnknownForce("hand_l", "walk", point_body=point)
    columns = candidate.signature(short_scene, (0.02,)).columns
    b = short_scene.skeleton.body_index("hand_l")
    place = short_scene.point_ground(b, np.array(point))
    expected = np.cross(place[:, None], columns[:, :3].transpose(0, 2, 1))
    np.testing.assert_allclose(columns[:, 3:].transpose(0, 2, 1), expected, atol=1e-12)


@pytest.mark.parametrize("name", ["hand_r", "torso", "calcn_l"])
def test_a_bodys_own_centre_lies_in_that_body(short_scene, name):
    b = short_scene.skeleton.body_index(name)
    centre = tuple(short_scene.skeleton.bodies[b].com_body)
    assert UnknownForce(name, "walk", point_body=centre).nearest_body(short_scene) == name


def test_a_point_far_out_lies_in_the_neighbour(short_scene):
    """The wrist, said in the forearm's frame and further on, is in the hand."""
    skeleton = short_scene.skeleton
    forearm, hand = skeleton.body_index("radius_l"), skeleton.body_index("hand_l")
    R, p = short_scene.R_ground_body, short_scene.p_ground_body
    centre = short_scene.point_ground(hand, skeleton.bodies[hand].com_body)
    own = (R[:, forearm].transpose(0, 2, 1) @ (centre - p[:, forearm])[..., None])[..., 0].mean(axis=0)
    assert UnknownForce("radius_l", "walk", point_body=tuple(own)).nearest_body(short_scene) == "hand_l"


def test_each_trial_has_its_own_forces_and_moments(short_scene, drawn):
    candidates = unknown_forces([short_scene])
    assert {c.trial for c in candidates} == {"walk"}
    assert sum(isinstance(c, UnknownMoment) for c in candidates) == len(KNOTS_S)
    assert all(c.signature(short_scene, c.starts([short_scene])[0]) is not None for c in candidates)
    assert UnknownForce("torso", "another").signature(short_scene, (0.02,)) is None
    assert UnknownMoment("", "another").signature(short_scene, (0.02,)) is None


def test_a_force_says_on_what_it_depends(short_scene):
    b = short_scene.skeleton.body_index("hand_l")
    com = short_scene.skeleton.bodies[b].com_body
    place = short_scene.point_ground(b, com)
    velocity = np.gradient(place, 0.01, axis=0)
    speed = np.linalg.norm(velocity, axis=1, keepdims=True)
    noise = np.random.default_rng(0).normal(0, 1, place.shape)
    for word, force in {
        "constant": np.tile([20.0, 5, 0], (len(place), 1)) + noise,
        "position": -150 * (place - place.mean(axis=0)) + noise,
        "velocity squared": -40 * speed * (velocity - velocity.mean(axis=0)) + noise,
        "acceleration": -3 * np.gradient(velocity, 0.01, axis=0) + noise,
        "none": 20 * noise,
    }.items():
        assert dependence(short_scene, force, b).startswith(word), word
    assert dependence(short_scene, np.zeros_like(place), b)
