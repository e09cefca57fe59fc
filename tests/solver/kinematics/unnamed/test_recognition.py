from dataclasses import replace

import numpy as np
import pytest

from solver.kinematics.unnamed.recognition import recognise
from solver.skeleton.default_body import default_skeleton


@pytest.fixture(scope="module")
def recognition(walker):
    markers, _ = walker
    return recognise([markers], {})


def test_nearly_all_markers_find_their_body(walker, recognition):
    _, places = walker
    right = [found.body == places[found.label].body for found in recognition.markers]
    assert recognition.person
    assert np.mean(right) >= 0.9


def test_left_is_not_taken_for_right(walker, recognition):
    _, places = walker
    of_a_side = [f for f in recognition.markers if f.body[-2:] in ("_r", "_l") and f.confidence >= 0.5]
    assert len(of_a_side) >= 20
    assert all(f.body[-2:] == places[f.label].body[-2:] for f in of_a_side if places[f.label].side)


def test_the_size_is_the_persons(recognition):
    assert recognition.size == pytest.approx(1.80 / 1.72, rel=0.05)


def test_a_mirrored_recording_changes_the_sides(walker, recognition):
    """Of a person walking backwards through a mirror, only left and right are exchanged."""
    markers, _ = walker
    mirrored = replace(markers, positions_ground=markers.positions_ground * (1, 1, -1))
    found = recognise([mirrored], {}).by_label()
    other = {"r": "l", "l": "r"}
    same = [
        found[f.label].body == (f.body[:-1] + other[f.body[-1]] if f.body[-2:] in ("_r", "_l") else f.body)
        for f in recognition.markers
    ]
    assert np.mean(same) >= 0.9


def test_places_of_known_labels_stay(walker):
    markers, places = walker
    named = ("pelvis", "torso", "femur", "humerus")
    known = {label: mark.name for label, mark in places.items() if mark.body.split("_")[0] in named}
    found = recognise([markers], known).by_label()
    assert all(found[label].body == places[label].body for label in known)
    rest = [label for label in places if label not in known]
    assert np.mean([found[label].body == places[label].body for label in rest]) >= 0.9


def test_a_cloud_that_is_nobody_is_no_person(walker):
    markers, _ = walker
    rng = np.random.default_rng(0)
    start = rng.uniform(0, 2, (1, 30, 3))
    wander = np.cumsum(rng.normal(0, 0.02, (60, 30, 3)), axis=0)
    blob = replace(markers, names=tuple(f"U{i}" for i in range(30)), positions_ground=start + wander)
    found = recognise([blob], {})
    assert found is None or not found.person


def test_too_few_markers_are_not_looked_at(walker):
    markers, _ = walker
    few = replace(markers, names=markers.names[:4], positions_ground=markers.positions_ground[:, :4])
    assert recognise([few], {}) is None


def test_the_default_body_is_the_measure_of_size():
    from solver.kinematics.unnamed.landmark_mixture import landmark_mixture

    assert landmark_mixture().skeleton.body_names == default_skeleton().body_names
