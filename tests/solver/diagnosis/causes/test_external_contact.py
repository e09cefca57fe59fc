from dataclasses import replace

import numpy as np
import pytest

from solver.diagnosis.causes.effect import Estimate, Fitted
from solver.diagnosis.causes.external_contact import ExternalContact
from solver.diagnosis.causes.observed_trial import force_at
from solver.simulate.loads import BodyPoint, PointForce, ease

SINCE, UNTIL = 0.8, 1.7  # [s]
FORCE = np.array([-15.0, 45.0, 10.0])
OFFSET = np.array([0.03, -0.05, 0.02])


@pytest.fixture(scope="module", params=["torso", "pelvis", "hand_r"])
def touch(request, scene, walk):
    body = scene.skeleton.body_index(request.param)
    place = scene.skeleton.bodies[body].com_body + OFFSET
    law = ease(FORCE, SINCE, UNTIL, 0.1)
    push = PointForce(BodyPoint(scene.skeleton, request.param, place), law)
    return request.param, place, push(walk.motion, scene.times)


@pytest.fixture(scope="module")
def touched(scene, recorded, touch):
    return recorded(scene.required_ground - touch[2])


def test_the_touched_body_is_a_candidate_at_the_right_time(touched, touch):
    own = [c for c in ExternalContact.candidates([touched]) if c.target == touch[0]]
    assert any(
        abs(c.windows[0].start - 100 * SINCE) < 12 and abs(c.windows[0].end - 100 * UNTIL) < 12 for c in own
    )


def test_the_body_is_found_beside_a_wrong_weight(scene, recorded, touch):
    """Which would have the force elsewhere: it acts at the centre of mass, and all along."""
    name, _, missing = touch
    weight = force_at(np.array([0.0, 45.0, 0.0]), scene.com_ground)
    made = ExternalContact.candidates([recorded(scene.required_ground - missing - weight)])
    whole = [c for c in made if abs(c.windows[0].start - 100 * SINCE) < 12]
    assert name in [c.target for c in whole[:4]]


def test_another_contact_is_no_wrong_weight(scene, recorded):
    """Each is sought by what is missing in its own time, whatever is missing in the other's."""
    skeleton = scene.skeleton
    missing = np.zeros((scene.frames, 6))
    for name, force, start, end in (("hand_r", 100.0, 20, 60), ("pelvis", 400.0, 90, 230)):
        body = skeleton.body_index(name)
        place = scene.point_ground(body, skeleton.bodies[body].com_body)
        missing[start:end] += force_at(np.array([0.0, force, 0.0]), place)[start:end]
    made = ExternalContact.candidates([recorded(scene.required_ground - missing)])
    first = [c for c in made if len(c.windows) == 1 and c.windows[0].start < 60]
    assert first[0].target == "hand_r"
    assert first[0].scales_N[0] == pytest.approx(100.0, abs=15.0)


def test_signature_holds_the_push(touched, touch, fitted):
    body, _, missing = touch
    candidate = next(c for c in ExternalContact.candidates([touched]) if c.target == body)
    x, covariance = fitted(candidate, touched, missing)
    left = missing - candidate.signature(touched, ()).columns @ x
    assert np.sqrt((left[:, :3] ** 2).mean()) < 0.08 * np.sqrt((missing[:, :3] ** 2).mean())
    found = candidate.estimates([touched], Fitted((), (), x, covariance))
    (touching,) = candidate.frames([touched], (), x)
    inside = slice(touching.start, touching.end)
    for i, axis in enumerate("xyz"):
        assert found[f"force_{axis}_N"].value == pytest.approx(missing[inside, i].mean(), abs=1.5)
    assert candidate.is_notable(found)


@pytest.mark.parametrize("ramp", [0.05, 0.1, 0.2, 0.3])
def test_mean_force_counts_from_its_beginning_to_its_end(scene, walk, recorded, fitted, ramp):
    """Whether it is there at once or grows over 0.3 s; the mean is that of the frames with any force."""
    place = scene.skeleton.bodies[scene.skeleton.body_index("torso")].com_body
    push = PointForce(BodyPoint(scene.skeleton, "torso", place), ease(FORCE, SINCE, UNTIL, ramp))
    missing = push(walk.motion, scene.times)
    own = recorded(scene.required_ground - missing)
    candidate = next(c for c in ExternalContact.candidates([own]) if c.target == "torso")
    x, covariance = fitted(candidate, own, missing)
    found = candidate.estimates([own], Fitted((), (), x, covariance))
    true = missing[missing[:, :3].any(axis=1), :3].mean(axis=0)
    for i, axis in enumerate("xyz"):
        stated = found[f"force_{axis}_N"]
        assert abs(stated.value - true[i]) < 2 * stated.std
        assert stated.std < 0.15 * np.linalg.norm(FORCE)


def test_a_contact_that_begins_within_the_trial_still_does_when_counted_whole(touched):
    candidate = next(iter(ExternalContact.candidates([touched])))
    late = replace(candidate.windows[0], start=3, end=touched.frames - 4)
    counted = replace(candidate, windows=(late,)).frames([touched], (), np.zeros(0))
    assert [(r.start, r.end) for r in counted] == [(1, touched.frames - 1)]


def test_point_is_found_across_the_line_of_action(touched, touch, fitted):
    """Along the force nothing tells where it acts."""
    body, place, missing = touch
    candidate = next(c for c in ExternalContact.candidates([touched]) if c.target == body)
    found = candidate.estimates([touched], Fitted((), (), *fitted(candidate, touched, missing)))
    b = touched.skeleton.body_index(body)
    off = np.array([found[f"point_{axis}_m"].value for axis in "xyz"]) - place
    middle = candidate.windows[0].start + 40
    along = touched.R_ground_body[middle, b].T @ FORCE / np.linalg.norm(FORCE)
    assert np.linalg.norm(off - (off @ along) * along) < 0.03


def test_trials_have_parameters_of_their_own(touched):
    other = replace(touched, name="other")
    both = [touched, other]
    candidate = next(c for c in ExternalContact.candidates(both) if len({w.trial for w in c.windows}) == 2)
    first, second = (candidate.signature(s, ()) for s in both)
    assert first.columns.shape == second.columns.shape
    own = [s.columns[:, :3].any(axis=(0, 1)) for s in (first, second)]
    assert not (own[0] & own[1]).any()
    assert {r.trial for r in candidate.frames(both, (), np.zeros(0))} == {"walk", "other"}


def test_feet_are_left_to_off_plate_steps(touched):
    assert not {c.target for c in ExternalContact.candidates([touched])} & {
        "calcn_r",
        "calcn_l",
        "toes_r",
        "toes_l",
    }


def test_a_touch_is_not_notable(touched):
    weak = {f"force_{a}_N": Estimate(5.0, 1.0) for a in "xyz"}
    assert not ExternalContact.candidates([touched])[0].is_notable(weak)


@pytest.mark.parametrize(("weights", "possible"), [(1.0, True), (2.0, False)])
def test_nobody_is_pushed_with_twice_the_weight_for_long(touched, weights, possible):
    candidate = ExternalContact.candidates([touched])[0]
    force = {"force_x_N": 0.0, "force_y_N": -weights * touched.weight_N, "force_z_N": 10.0}
    estimates = {name: Estimate(value, 1.0) for name, value in force.items()}
    assert candidate.is_possible(estimates) is possible
    assert candidate.is_notable(estimates) is possible


def test_what_lies_between_trunk_and_hand_or_foot_is_touched_rarely(scene, recorded):
    """Wherever something pushes: trunk, thighs and hands are usual places, what is between is not."""
    skeleton = scene.skeleton
    usual, rare = set(), set()
    for body, segment in enumerate(skeleton.bodies):
        missing = np.zeros((scene.frames, 6))
        place = scene.point_ground(body, segment.com_body)
        missing[60:160] = force_at(np.array([0.0, 90.0, 30.0]), place)[60:160]
        for candidate in ExternalContact.candidates([recorded(scene.required_ground - missing)]):
            (rare if candidate.place_odds else usual).add(candidate.target)
    assert {"pelvis", "torso", "femur_r", "femur_l"} <= usual
    assert {"tibia_r", "tibia_l"} <= rare
    assert rare <= {f"{bone}_{side}" for bone in ("humerus", "ulna", "radius", "tibia") for side in "rl"}
    assert not rare & usual
