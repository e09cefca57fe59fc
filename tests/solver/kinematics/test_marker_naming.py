import numpy as np
import pytest

from solver.capture.capture import Markers
from solver.common.errors import FitError
from solver.kinematics.marker_matching import match_markers
from solver.kinematics.marker_naming import name_markers
from solver.kinematics.own_model_naming import own_names
from solver.markers.atlas import atlas, landmark_marker
from solver.skeleton.default_body import default_skeleton
from solver.skeleton.forward import marker_positions
from solver.skeleton.skeleton import Marker

BONY = {
    "asis": "IAS", "knee_lateral": "FLE", "knee_medial": "FME", "ankle_lateral": "FAL", "ankle_medial": "TAM",
    "heel": "FCC", "mt5_head": "FM5", "fibula_head": "FAX", "acromion": "AC", "trochanter": "FTC",
}  # fmt: skip


@pytest.fixture(scope="module")
def body():
    return default_skeleton()


def recording(body, marks):
    """Markers at landmarks, by label, in quiet stance."""
    skeleton = body.with_markers([landmark_marker(atlas()[n], label, body) for label, n in marks.items()])
    x = marker_positions(skeleton, np.repeat(body.default_q[None], 10, axis=0))
    return Markers(tuple(marks), x, 100.0)


def both_sides(spelled):
    return {spelled(side, code): f"{name}_{side.lower()}" for name, code in BONY.items() for side in "RL"}


def places(skeleton, match):
    return {m.name: (skeleton.bodies[m.body].name, m.position_body) for m in match.skeleton(skeleton).markers}


def test_labels_that_the_default_body_does_not_know_get_a_marker_at_their_landmark(body):
    markers = recording(body, both_sides("{0}{1}".format))
    named = name_markers(body, [markers], default_body=True)
    assert set(markers.names) == {name for names in named.match.measured for name in names}
    at = places(named.skeleton, named.match)
    assert at["RFAX"][0] == "tibia_r"
    np.testing.assert_allclose(at["RFAX"][1] * (1, 1, -1), at["LFAX"][1])
    assert any("RFAX" in note for note in named.match.notes)


def test_the_default_bodys_own_names_keep_their_markers(body):
    names = [
        m.name
        for m in body.markers
        if m.name[1:] in {"ASI", "PSI", "KNE", "ANK", "HEE", "TOE", "THI", "TIB", "SHO"}
    ]
    x = marker_positions(body, np.repeat(body.default_q[None], 10, axis=0))
    columns = [body.marker_names.index(n) for n in names]
    markers = Markers(tuple(names), x[:, columns], 100.0)
    before, after = match_markers(body, [markers]), name_markers(body, [markers], default_body=True)
    assert after.match.model == before.model
    for old, new in zip(
        before.skeleton(body).markers, after.match.skeleton(after.skeleton).markers, strict=True
    ):
        assert old is new


def test_other_spellings_in_another_recording_are_the_same_marker(body):
    walk = recording(body, both_sides("{0}{1}".format))
    static = recording(body, both_sides("{1}_{0}".format))
    named = name_markers(body, [walk, static], default_body=True)
    assert len(named.match.model) == len(walk.names)
    assert np.isfinite(named.match.observed(static)).all()


def test_a_persons_word_comes_first(body):
    marks = both_sides("{0}{1}".format) | {"M1": "c7", "M2": "t10"}
    markers = recording(body, marks)
    named = name_markers(body, [markers], default_body=True, chosen={"M1": "c7", "RFAX": "", "M2": "T10"})
    at = places(named.skeleton, named.match)
    assert at["M1"][0] == "torso"
    assert "T10" in named.match.model
    assert not any("RFAX" in names for names in named.match.measured)


def test_a_word_that_means_nothing_is_refused_with_the_nearest(body):
    markers = recording(body, both_sides("{0}{1}".format))
    with pytest.raises(FitError, match="asis_r"):
        name_markers(body, [markers], default_body=True, chosen={"RIAS": "asis_right"})


def own_model(body, spelled):
    marks = both_sides(spelled)
    return body.with_markers([landmark_marker(atlas()[n], label, body) for label, n in marks.items()])


def test_a_model_of_ones_own_with_the_side_spelled_otherwise(body):
    model = own_model(body, lambda side, code: f"{code.lower()}_{side.lower()}")
    markers = recording(body, both_sides(lambda side, code: f"{ {'R': 'right', 'L': 'left'}[side] }.{code}"))
    named = name_markers(model, [markers], default_body=False)
    assert named.skeleton.bodies is model.bodies
    assert named.skeleton.marker_names == model.marker_names
    measured = dict(zip(named.match.model, named.match.measured, strict=True))
    assert measured["fle_r"] == ("right.FLE",)
    assert len(measured) == len(markers.names)


def test_a_model_of_ones_own_with_other_names_for_the_same_bony_landmarks(body):
    model = own_model(body, "{0}{1}".format)
    names = {
        "asis": "ASI",
        "knee_lateral": "KNE",
        "ankle_lateral": "ANK",
        "heel": "HEE",
        "acromion": "SHO",
        "mt5_head": "MT5",
    }
    markers = recording(body, {s + code: f"{n}_{s.lower()}" for n, code in names.items() for s in "RL"})
    named = name_markers(model, [markers], default_body=False)
    measured = dict(zip(named.match.model, named.match.measured, strict=True))
    assert measured["LFAL"] == ("LANK",)
    assert any("LANK = LFAL" in note for note in named.match.notes)


def test_tracking_markers_of_ones_own_model_are_never_guessed(body):
    model = own_model(body, "{0}{1}".format)
    thigh = body.body_index("femur_r")
    model = model.with_markers([*model.markers, Marker("RCLUSTER", thigh, np.array([0.05, -0.2, 0.0]))])
    markers = recording(body, both_sides("{0}{1}".format) | {"RTHI": "thigh_wand_r"})
    named = name_markers(model, [markers], default_body=False)
    assert "RCLUSTER" not in named.match.model


def test_two_labels_for_one_marker_of_ones_own_model_are_refused(body):
    model = own_model(body, "{0}{1}".format)
    markers = recording(body, both_sides("{0}{1}".format) | {"X1": "c7", "X2": "t10"})
    with pytest.raises(FitError, match="both X1 and X2"):
        name_markers(model, [markers], default_body=False, chosen={"X1": "RFLE", "X2": "RFLE"})


def test_labels_that_mean_nothing_are_found_for_a_model_of_ones_own(walker):
    markers, truth = walker
    generic = default_skeleton()
    model = generic.with_markers(
        [landmark_marker(mark, f"my {mark.name}", generic) for mark in truth.values() if mark.kind == "bony"]
    )
    named = name_markers(model, [markers], default_body=False)
    body = {m.name: named.skeleton.bodies[m.body].name for m in named.skeleton.markers}
    measured = dict(zip(named.match.model, (labels[0] for labels in named.match.measured), strict=True))
    paired = {name: label for name, label in measured.items() if name.startswith("my ")}
    assert len(paired) >= 0.6 * len(model.markers)
    assert np.mean([f"my {truth[label].name}" == name for name, label in paired.items()]) >= 0.9
    carried = measured.keys() - paired.keys()  # the thighs' and shanks' wands, which the model does not have
    assert len(carried) >= 4
    assert np.mean([truth[label].body == body[label] for label in carried]) >= 0.9
    assert any("found by the motion" in note for note in named.match.notes)


@pytest.mark.slow
def test_a_model_of_ones_own_without_telling_names_has_labels_that_mean_nothing_put_on_its_bodies(walker):
    markers, truth = walker
    generic = default_skeleton()
    model = generic.with_markers(
        [landmark_marker(mark, f"Q{i:02d}X", generic) for i, mark in enumerate(truth.values())]
    )
    named = name_markers(model, [markers], default_body=False)
    on = {m.name: named.skeleton.bodies[m.body].name for m in named.skeleton.markers}
    used = dict(zip(named.match.model, (labels[0] for labels in named.match.measured), strict=True))
    assert len(used) >= 0.8 * len(truth)
    assert np.mean([truth[label].body == on[name] for name, label in used.items()]) >= 0.9
    assert not any(name.startswith("Q") for name in used)  # what these are, nothing says


def test_what_is_said_of_a_model_of_ones_own_changes_nothing_when_said_to_it(body):
    model = own_model(body, lambda side, code: f"{code.lower()}_{side.lower()}")
    marks = both_sides(lambda side, code: f"{ {'R': 'right', 'L': 'left'}[side] }.{code}")
    markers = recording(body, marks | {"VERTEX": "head_top"})
    by_itself = name_markers(model, [markers], default_body=False)
    word = own_names(model, [markers])
    assert word["right.FLE"] == "fle_r"
    assert "VERTEX" not in word
    said = name_markers(model, [markers], default_body=False, chosen=word)
    assert sorted(said.match.model) == sorted(by_itself.match.model)


def test_a_map_that_speaks_of_labels_nobody_has_is_noted(body):
    markers = recording(body, both_sides("{0}{1}".format))
    word = {"RFLEE": "knee_lateral_r", "RFAX": ""}
    match = name_markers(body, [markers], default_body=True, chosen=word).match
    (note,) = [n for n in match.notes if "no recording has" in n]
    assert "'RFLEE' (nearest: 'RFLE')" in note
    assert "RFAX" not in note
    assert not any("explains" in n and "RFLEE" in n for n in match.notes)


def test_one_bony_place_for_two_labels_is_refused(body):
    markers = recording(body, both_sides("{0}{1}".format))
    word = {"RFLE": "knee_lateral_r", "RFAL": "knee_lateral_r"}
    with pytest.raises(FitError, match="'knee_lateral_r' to both RFAL and RFLE"):
        name_markers(body, [markers], default_body=True, chosen=word)


def test_tracking_markers_may_share_a_place_in_the_map(body):
    markers = recording(body, both_sides("{0}{1}".format) | {"A": "thigh_cluster_r", "B": "thigh_cluster_r"})
    word = {"A": "thigh_cluster_r", "B": "thigh_cluster_r"}
    match = name_markers(body, [markers], default_body=True, chosen=word).match
    assert {"A", "B"} <= {name for names in match.measured for name in names}


def test_a_map_that_leaves_out_too_much_is_blamed(body):
    markers = recording(body, both_sides("{0}{1}".format))
    with pytest.raises(FitError, match=r"The marker map leaves out 18 labels\.$"):
        name_markers(body, [markers], default_body=True, chosen=dict.fromkeys(markers.names[:18], ""))
