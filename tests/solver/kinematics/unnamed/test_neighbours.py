import numpy as np
import pytest

from solver.kinematics.unnamed.landmark_mixture import landmark_mixture
from solver.kinematics.unnamed.neighbours import weighed_against_neighbours
from solver.kinematics.unnamed.whole_recording import Followed, Seen, Tolerance, attach

MIXTURE = landmark_mixture()
NAMES = [mark.name for mark in MIXTURE.landmarks]
WHOLE_BODY = [
    "asis_r", "asis_l", "psis_r", "psis_l", "c7",
    "acromion_r", "acromion_l", "thigh_front_r", "thigh_front_l", "knee_lateral_r",
    "knee_medial_r", "knee_lateral_l", "knee_medial_l", "shank_front_r", "shank_front_l",
    "ankle_lateral_r", "ankle_medial_r", "ankle_lateral_l", "ankle_medial_l", "heel_r",
    "heel_l", "mt1_head_r", "mt5_head_r", "mt1_head_l", "mt5_head_l",
    "elbow_lateral_r", "elbow_medial_r", "forearm_r", "wrist_radial_r", "wrist_ulnar_r",
]  # fmt: skip


def before_and_after(labels, bending):
    """Probabilities of bodies, by place and rigidity in the true poses, and weighed against neighbours."""
    q = np.tile(MIXTURE.skeleton.default_q, (20, 1))
    for dof, most in bending.items():
        q[:, MIXTURE.skeleton.dofs.index(dof)] += np.linspace(0, most, 20)
    places = MIXTURE.kinematics.markers(MIXTURE.kinematics.poses(q))
    seen = Seen(places[:, [NAMES.index(label) for label in labels]], np.ones((len(labels), len(NAMES)), bool))
    share = np.full((len(labels), len(NAMES)), 1 / len(NAMES))
    for _ in range(3):
        found = attach(seen, q, share, MIXTURE, tolerance=Tolerance(0.015, 0.015), arms=True)
        share = found.share
    followed = Followed(q, 1.0, True, found, 0.0, np.ones((len(MIXTURE.skeleton.bodies), 3)))
    return found.on_body(MIXTURE), weighed_against_neighbours(seen, followed, MIXTURE)


@pytest.fixture(scope="module")
def walking():
    knees_and_ankles = {"knee_angle_r": 0.8, "knee_angle_l": 0.8, "ankle_angle_r": 0.3, "ankle_angle_l": 0.3}
    return before_and_after(WHOLE_BODY, knees_and_ankles | {"elbow_flex_r": 0.5})


def confidence(belief, label, body):
    return belief[WHOLE_BODY.index(label), MIXTURE.skeleton.body_index(body)]


def test_nothing_is_added_and_the_likeliest_body_stays(walking):
    before, after = walking
    np.testing.assert_allclose(after.sum(axis=1), before.sum(axis=1))
    assert (after.argmax(axis=1) == before.argmax(axis=1)).all()
    assert (after.max(axis=1) <= before.max(axis=1) + 1e-12).all()


def test_far_from_any_joint_nothing_is_doubted(walking):
    before, after = walking
    for label, body in (("thigh_front_r", "femur_r"), ("c7", "torso"), ("mt1_head_r", "calcn_r")):
        assert confidence(after, label, body) > 0.95 * confidence(before, label, body)


def test_which_bone_of_the_forearm_is_known_only_once_it_turns(walking):
    _, after = walking
    assert confidence(after, "forearm_r", "radius_r") > 0.5 * confidence(after, "forearm_r", "ulna_r")
    _, turning = before_and_after(WHOLE_BODY, {"pro_sup_r": 1.2, "elbow_flex_r": 0.5})
    assert confidence(turning, "forearm_r", "radius_r") < 0.1 * confidence(turning, "forearm_r", "ulna_r")


def test_an_ankle_is_surer_with_a_whole_foot_below_it_than_with_one_marker():
    """A foot that one marker holds follows the malleolus wherever it is said to be."""
    alone = [label for label in WHOLE_BODY if label not in ("heel_r", "mt1_head_r", "ankle_medial_r")]
    bending = {"knee_angle_r": 0.8, "ankle_angle_r": 0.3, "knee_angle_l": 0.8, "ankle_angle_l": 0.3}
    _, few = before_and_after(alone, bending)
    _, many = before_and_after(WHOLE_BODY, bending)
    tibia = MIXTURE.skeleton.body_index("tibia_r")
    ankle = "ankle_lateral_r"
    assert few[alone.index(ankle), tibia] < many[WHOLE_BODY.index(ankle), tibia]
