"""A model without a marker set: where its markers were put by its maker, landmarks are placed again."""

from dataclasses import replace

import numpy as np
import pytest

from solver.capture.capture import Markers
from solver.common.errors import FitError
from solver.kinematics.marker_naming import name_markers
from solver.kinematics.own_model_naming import is_bare, placed_on_model
from solver.markers.atlas import atlas, landmark_marker
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import marker_positions
from solver.skeleton.scaling import scaled
from solver.skeleton.skeleton import Marker, Skeleton

LABELS = {
    f"{side}{code}": f"{landmark}_{side.lower()}"
    for code, landmark in {
        "ASI": "asis", "PSI": "psis", "KNE": "knee_lateral", "KNM": "knee_medial", "ANK": "ankle_lateral",
        "MED": "ankle_medial", "HEE": "heel", "SHO": "acromion",
    }.items()
    for side in "RL"
}  # fmt: skip


@pytest.fixture(scope="module")
def default() -> Skeleton:
    return default_skeleton()


@pytest.fixture(scope="module")
def marked(default) -> Skeleton:
    """A person with longer shanks and a wider pelvis than the default body, marked at landmarks."""
    with_markers = default.with_markers(
        [landmark_marker(atlas()[name], label, default) for label, name in LABELS.items()]
    )
    factors = np.ones((len(default.bodies), 3))
    for name in ("tibia_r", "tibia_l"):
        factors[default.body_index(name)] = 1.12
    factors[default.body_index("pelvis")] = 1.08
    return scaled(with_markers, factors)


def seen(skeleton: Skeleton) -> Markers:
    x = marker_positions(skeleton, np.repeat(skeleton.default_q[None], 10, axis=0))
    return Markers(skeleton.marker_names, x, 100.0)


def test_labels_are_put_at_their_landmarks_in_proportion_to_each_segment(marked):
    bare = marked.with_markers([])
    assert is_bare(bare)
    assert not is_bare(marked)
    named = name_markers(bare, [seen(marked)], default_body=False)
    at = {m.name: m for m in named.match.skeleton(named.skeleton).markers}
    measured = dict(zip(named.match.model, named.match.measured, strict=True))
    true = {m.name: m for m in marked.markers}
    assert len(at) == len(LABELS)
    for name, marker in at.items():
        (label,) = measured[name]
        assert marker.body == true[label].body
        assert np.linalg.norm(marker.position_body - true[label].position_body) < 0.012
    assert any("put where the atlas has them" in note for note in named.match.notes)


def test_segments_whose_frames_lie_otherwise_get_no_marker(default, marked):
    """A shank whose frame is turned by a right angle is no shank that the atlas knows."""
    shank = default.body_index("tibia_r")
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    joints = tuple(
        replace(joint, R_child_frame=quarter) if b == shank else joint
        for b, joint in enumerate(default.joints)
    )
    turned = replace(default, joints=joints)
    place = np.array([0.02, -0.1, 0.03])
    thigh = default.body_index("femur_l")
    markers = [Marker("shank", shank, place), Marker("thigh", thigh, place)]
    assert list(placed_on_model(markers, default, turned)) == ["thigh"]


def test_a_persons_word_may_name_landmarks(marked):
    markers = seen(marked)
    strange = replace(markers, names=tuple("XYZ" if n == "RHEE" else n for n in markers.names))
    own = Marker("my own", marked.body_index("torso"), np.array([0.05, 0.3, 0.0]))
    bare = marked.with_markers([own])
    word = {"XYZ": "heel_r", "LHEE": "", "RSHO": "my own"}
    named = name_markers(bare, [strange], default_body=False, chosen=word)
    body = {m.name: bare.bodies[m.body].name for m in named.skeleton.markers}
    measured = {label: name for name, (label,) in zip(named.match.model, named.match.measured, strict=True)}
    assert body[measured["XYZ"]] == "calcn_r"
    assert "LHEE" not in measured
    assert measured["RSHO"] == "my own"


def test_a_model_of_other_segments_is_refused_with_what_to_do(marked):
    bodies = tuple(replace(body, name=f"segment {b}") for b, body in enumerate(marked.bodies))
    with pytest.raises(FitError, match="Without any model it is fitted on the default body"):
        name_markers(replace(marked, bodies=bodies, markers=()), [seen(marked)], default_body=False)


def test_the_few_markers_that_a_model_has_stay_where_they_are(marked):
    own = [m for m in marked.markers if m.name in ("RASI", "RSHO")]
    moved = [replace(m, position_body=m.position_body + 0.01) for m in own]
    named = name_markers(marked.with_markers(moved), [seen(marked)], default_body=False)
    at = {m.name: m.position_body for m in named.match.skeleton(named.skeleton).markers}
    for marker in moved:
        np.testing.assert_array_equal(at[marker.name], marker.position_body)
    assert len(at) == len(LABELS)


def test_a_joint_that_lies_otherwise_is_set_aside(default):
    """Another height of the lumbar joint makes the pelvis no other bone; another place of the hips does."""
    pelvis, torso = default.body_index("pelvis"), default.body_index("torso")
    asis = Marker("asis", pelvis, np.array([0.0, 0.0, 0.12]))
    higher = _with_joint_moved(default, torso, np.array([0.0, 0.07, 0.0]))
    (placed,) = placed_on_model([asis], default, higher).values()
    np.testing.assert_allclose(placed.position_body, asis.position_body, rtol=0.02)
    hips = _with_joint_moved(higher, default.body_index("femur_r"), np.array([0.1, -0.1, 0.0]))
    hips = _with_joint_moved(hips, default.body_index("femur_l"), np.array([0.1, 0.1, 0.0]))
    assert placed_on_model([asis], default, hips) == {}


def _with_joint_moved(skeleton: Skeleton, body: int, by: np.ndarray) -> Skeleton:
    joints = list(skeleton.joints)
    joints[body] = replace(joints[body], p_parent_frame=joints[body].p_parent_frame + by)
    return replace(skeleton, joints=tuple(joints))


def test_what_the_map_says_of_an_unplaceable_model_is_not_taken_for_known(marked):
    bodies = tuple(replace(body, name=f"segment {b}") for b, body in enumerate(marked.bodies))
    word = dict(list(LABELS.items())[:8])
    with pytest.raises(FitError, match="It does not know RASI"):
        name_markers(
            replace(marked, bodies=bodies, markers=()), [seen(marked)], default_body=False, chosen=word
        )
