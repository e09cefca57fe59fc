from dataclasses import replace

import numpy as np
import pytest

from solver.capture.capture import Markers
from solver.common.errors import FitError
from solver.kinematics import label_reading
from solver.kinematics.label_reading import LEG, read_labels
from solver.kinematics.marker_naming import name_markers
from solver.skeleton.default_body import default_skeleton


@pytest.fixture(scope="module")
def body():
    return default_skeleton()


def test_labels_that_mean_nothing_are_attached_and_named_in_the_notes(walker, body):
    markers, places = walker
    named = name_markers(body, [markers], default_body=True)
    at = {m.name: named.skeleton.bodies[m.body].name for m in named.match.skeleton(named.skeleton).markers}
    assert len(at) >= 0.9 * len(places)
    assert np.mean([at[label] == places[label].body for label in at]) >= 0.9
    assert any("attached to the bodies that they move with" in note for note in named.match.notes)


def test_names_on_the_wrong_trajectories_are_not_believed(walker, body):
    markers, places = walker
    wrong = np.random.default_rng(2).permutation(list(places.values()))
    names = tuple(mark.name for mark in wrong)
    read = read_labels(body, [replace(markers, names=names)])
    rows = read.understanding.by_label()
    truth = {name: places[label].body for name, label in zip(names, markers.names, strict=True)}
    assert any("contradict" in note for note in read.notes)
    assert np.mean([rows[name].body == truth[name] for name in names]) >= 0.9


def test_a_marker_without_a_name_among_named_ones_is_attached(walker, body):
    markers, places = walker
    unnamed = [label for label, mark in places.items() if mark.name in ("thigh_front_r", "shank_front_l")]
    names = tuple(label if label in unnamed else places[label].name for label in markers.names)
    read = read_labels(body, [replace(markers, names=names)])
    assert {label: read.understanding.by_label()[label].body for label in unnamed} == {
        label: places[label].body for label in unnamed
    }
    assert set(read.found) == set(unnamed)


@pytest.mark.parametrize(("each", "attached"), [(1, False), (2, False), (5, True)])
def test_wheels_are_no_legs_where_no_name_tells_of_one(walker, body, each, attached):
    """One or two things on a side that move like a leg; a whole leg's markers by other names are legs."""
    markers, places = walker
    of_leg = {
        side: [n for n, mark in places.items() if mark.body.startswith(LEG) and mark.body.endswith(side)]
        for side in ("_r", "_l")
    }
    kept = {label for labels in of_leg.values() for label in labels[:each]}
    rest = [label for label, mark in places.items() if not mark.body.startswith(LEG)]
    columns = [k for k, label in enumerate(markers.names) if label in kept or label in rest]
    names = tuple(
        markers.names[k] if markers.names[k] in kept else places[markers.names[k]].name for k in columns
    )
    read = read_labels(body, [Markers(names, markers.positions_ground[:, columns], markers.rate)])
    on_legs = [marker for marker in read.found.values() if body.body_names[marker.body].startswith(LEG)]
    assert bool(on_legs) == attached


@pytest.mark.slow
def test_a_person_may_say_what_a_label_is(walker, body):
    markers, places = walker
    c7 = next(label for label, mark in places.items() if mark.name == "c7")
    named = name_markers(body, [markers], default_body=True, chosen={c7: "t4"})
    at = {m.name: m for m in named.skeleton.markers}
    assert named.skeleton.bodies[at[c7].body].name == "torso"
    assert any("marker map" in note and c7 in note for note in named.match.notes)


def test_few_markers_make_no_person(walker, body, monkeypatch):
    """With as many as usual they are found: see the first test."""
    markers, _ = walker
    monkeypatch.setattr(label_reading, "FEWEST_MARKERS", len(markers.names) + 1)
    assert not read_labels(body, [markers]).found
    with pytest.raises(FitError):
        name_markers(body, [markers], default_body=True)


def test_labels_given_anew_in_another_recording_are_refused(walker, body):
    markers, _ = walker
    shuffled = np.random.default_rng(1).permutation(len(markers.names))
    other = replace(markers, positions_ground=markers.positions_ground[:, shuffled])
    with pytest.raises(FitError, match="one at a time"):
        read_labels(body, [markers, other])


def with_spines(walker, apart_m):
    """The walker with names, and the posterior spines further apart."""
    markers, places = walker
    names = tuple(places[label].name for label in markers.names)
    x = markers.positions_ground.copy()
    right, left = names.index("psis_r"), names.index("psis_l")
    along = x[:, names.index("asis_r")] - x[:, names.index("asis_l")]
    out = 0.5 * apart_m * along / np.linalg.norm(along, axis=1, keepdims=True)
    x[:, right] += out
    x[:, left] -= out
    return replace(markers, names=names, positions_ground=x)


def test_markers_of_a_frame_track_their_body_from_where_they_are_on_both_sides(walker, body):
    read = read_labels(body, [with_spines(walker, 0.24)])
    rows = read.understanding.by_label()
    assert [rows[f"psis_{side}"].body for side in "rl"] == ["pelvis", "pelvis"]
    off = read.found["psis_r"].position_body - read.found["psis_l"].position_body
    assert off[2] > 0.2  # ISB axes: z to the right


@pytest.mark.parametrize("other", ["thigh_front", "acromion"])
def test_a_label_is_never_attached_to_another_body_than_its_name_says(walker, body, other):
    """Whatever it moves with."""
    markers = with_spines(walker, 0.0)
    x = markers.positions_ground
    for side in "rl":
        there = [markers.names.index(f"{n}_{side}") for n in (other, "psis")]
        x[:, there[1]] = x[:, there[0]] + [0.0, 0.03, 0.0]
    rows = read_labels(body, [markers]).understanding.by_label()
    assert not any(rows[f"psis_{side}"].used and rows[f"psis_{side}"].body != "pelvis" for side in "rl")
