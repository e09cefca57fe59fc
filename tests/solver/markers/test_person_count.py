"""Lengths of the body tell people apart, and not one person's recordings."""

from dataclasses import replace

import numpy as np
import pytest

from solver.capture.subject.opened_subject import open_subject
from solver.capture.subject.same_motion import markers_of
from solver.markers.person_count import Recorded, people_among, subjects_among

FOUR, SIX = "opencap_subject4/MarkerData/", "opencap_subject6/"
MIXTURES = {
    "two walks": ({"a": FOUR + "walking1.trc", "b": SIX + "walking1.trc"}, "two people: a | b"),
    "one among six": (
        {name: f"{FOUR}{name}.trc" for name in ("DJ1", "STS1", "squats1", "walking1", "static1")}
        | {"stranger": SIX + "walking1.trc"},
        "two people: DJ1, STS1, squats1, walking1, static1 | stranger",
    ),
    "another's static trial": (
        {"jump": FOUR + "DJ1.trc", "walk": FOUR + "walking1.trc", "static": SIX + "static1.trc"},
        "two people: jump, walk | static",
    ),
    "three people": (
        {
            "a": FOUR + "walking1.trc",
            "b": SIX + "walking1.trc",
            "a's static": FOUR + "static1.trc",
            "c": "opencap_reviewed/trials/DJ1/markers.trc",
        },
        "three people: a, a's static | b | c",
    ),
    "two laboratories, one label set": (
        {
            "walk": "c3d_lab_trials/lasem_FAILT01/FAILT01_Walk01.c3d",
            "run": "sprint_overground_dorn2012_JA1_9ms/run0900cms.trc",
        },
        "two people: walk | run",
    ),
}


def said(recordings):
    """That they are several people; by their markers alone."""
    return people_among({name: Recorded(markers) for name, markers in recordings.items()}).said


@pytest.mark.parametrize("name", MIXTURES)
def test_several_people_are_told_with_the_names_of_their_trials(real_data, name):
    files, told = MIXTURES[name]
    note = said({trial: markers_of(real_data / file) for trial, file in files.items()})
    assert f"these trials seem to be of {told} (" in note


def test_recordings_of_one_person_raise_no_alarm(real_data):
    folders = {path.parent for name in ("subject.toml", "_subject.json") for path in real_data.rglob(name)}
    compared = 0
    for folder in folders:
        subject = open_subject(folder)
        assert subjects_among(subject) == (subject,), folder
        compared += len(subject.trials) > 1 or subject.static is not None
    assert compared >= 8


def test_markers_that_were_placed_again_are_no_other_person(real_data):
    """On one who stands, a shift of a marker is one on the body: 6 mm along each axis, 1 cm in all."""
    standing = markers_of(real_data / FOUR / "static1.trc")
    rng = np.random.default_rng(0)
    for _ in range(20):
        shift = rng.normal(0.0, 0.006, (1, len(standing.names), 3))
        again = replace(standing, positions_ground=standing.positions_ground + shift)
        assert not said({"first day": standing, "second day": again})


def test_a_child_with_the_same_proportions_is_another_person(real_data):
    adult = markers_of(real_data / FOUR / "walking1.trc")
    child = replace(adult, positions_ground=0.85 * adult.positions_ground)
    note = said({"adult": adult, "child": child})
    assert "two people: adult | child" in note
    hair = replace(adult, positions_ground=1.005 * adult.positions_ground)
    assert not said({"adult": adult, "scaled by a hair": hair})


def test_trials_in_one_file_are_of_one_person_unless_it_names_several(real_data, tmp_path):
    walk = markers_of(real_data / FOUR / "walking1.trc")
    grown = replace(walk, positions_ground=1.03 * walk.positions_ground)
    file = tmp_path / "results.b3d"
    assert not people_among({"a": Recorded(walk, file), "b": Recorded(grown, file)}).said
    both = {"a": Recorded(walk, file, "Anna"), "b": Recorded(grown, file, "Bea")}
    assert "they are in one file together" in people_among(both).said


def test_what_cannot_be_compared_raises_no_alarm(real_data):
    walk = markers_of(real_data / FOUR / "walking1.trc")
    renamed = replace(walk, names=tuple(f"{name}_{k}" for k, name in enumerate(walk.names)))
    assert not said({"a": walk, "b": renamed})
    assert not said({"a": walk})
    assert not said({})


@pytest.mark.parametrize("name", ["static", "walk1"])
def test_sides_exchanged_in_a_whole_recording_make_no_other_person(real_data, name):
    folder = real_data / "walk_gait2354_subject01"
    files = {each: markers_of(folder / f"subject01_{each}.trc") for each in ("static", "walk1")}
    labels = files[name].names
    swapped = [{"L": "R", "R": "L"}.get(label[0], label[0]) + label[1:] for label in labels]
    swapped = tuple(new if new in labels else old for new, old in zip(swapped, labels, strict=True))
    assert sum(new != old for new, old in zip(swapped, labels, strict=True)) > 20
    files[name] = replace(files[name], names=swapped)
    assert not said(files)


def test_what_is_only_likely_is_told_and_stops_nothing(real_data, tmp_path):
    """Two people of two laboratories whose lengths say twenty to one."""
    standing = "c3d_lab_trials/lasem_FAILT01/FAILT01_static02.c3d"
    (tmp_path / "static.c3d").write_bytes((real_data / standing).read_bytes())
    run = real_data / "sprint_overground_dorn2012_JA1_9ms/run0900cms.trc"
    (tmp_path / "run.trc").write_bytes(run.read_bytes())
    (subject,) = subjects_among(open_subject(tmp_path))
    assert subject.folder == tmp_path
    assert "two people: run | static (static)" in subject.notes[0]
