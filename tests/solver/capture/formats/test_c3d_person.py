"""What a C3D file states of the person is read: in any of the groups, keys and units that programs write."""

from dataclasses import replace

import numpy as np
import pytest

from solver.capture.capture import Markers
from solver.capture.formats.c3d_person import stated_person
from solver.capture.subject.subject import open_subject
from solver.export.c3d_file import C3dRecording
from solver.export.c3d_file import write_c3d as export_c3d

POINTS = np.random.default_rng(1).uniform(0, 1000, (10, 4, 3))
LABELS = ["LASI", "RASI", "LPSI", "RPSI"]


@pytest.mark.parametrize(
    ("parameters", "mass", "height"),
    [
        ({"PROCESSING__Bodymass": [27.7], "PROCESSING__Height": [1330.0]}, 27.7, 1.33),
        ({"PROCESSING__BodyMass": [67.0], "PROCESSING__HEIGHT": [182.0]}, 67.0, 1.82),
        ({"SUBJECTS__A_BodyMass_kg": ["41.5"], "SUBJECTS__A_Height_mm": ["161"]}, 41.5, 1.61),
        ({"SUBJECT__WEIGHT": [70.62], "SUBJECT__HEIGHT": [1.78]}, 70.62, 1.78),
        ({"PROCESSING__Bodymass": [0.0], "PROCESSING__Height": [0.0]}, None, None),
        ({"SUBJECTS__WEIGHT": ["NaN"], "SUBJECTS__HEIGHT": [""]}, None, None),
        ({"PROCESSING__HeadMass": [5.0], "PROCESSING__SeatHeight": [450.0]}, None, None),
    ],
)
def test_mass_and_height(write_c3d, tmp_path, parameters, mass, height):
    stated = stated_person(write_c3d(tmp_path / "a.c3d", POINTS, LABELS, **parameters))
    assert stated.mass_kg == pytest.approx(mass)
    assert stated.height_m == pytest.approx(height)


def test_names_sex_and_age(write_c3d, tmp_path):
    about = {"SUBJECTS__NAMES": ["P07", "default"], "SUBJECTS__SEX": ["F"], "SUBJECTS__AGE": ["15"]}
    stated = stated_person(write_c3d(tmp_path / "a.c3d", POINTS, LABELS, **about))
    assert (stated.names, stated.sex, stated.age_years) == ({"P07"}, "female", 15)


def test_a_subject_has_what_its_files_state_and_what_was_entered_stands(write_c3d, tmp_path):
    about = {"PROCESSING__Bodymass": [27.7], "PROCESSING__Height": [1330.0]}
    write_c3d(tmp_path / "walk.c3d", POINTS, LABELS, **about)
    subject = open_subject(tmp_path)
    assert (subject.mass_kg, subject.height_m) == (pytest.approx(27.7), pytest.approx(1.33))
    assert any("mass 27.7 kg: stated in walk.c3d" in note for note in subject.notes)
    (tmp_path / "subject.toml").write_text("mass_kg = 30.0\n")
    entered = open_subject(tmp_path)
    assert (entered.mass_kg, entered.height_m) == (30.0, pytest.approx(1.33))
    assert not any("mass" in note for note in entered.notes)


def test_files_that_state_different_masses_state_none(write_c3d, tmp_path):
    for name, mass in (("walk1", 60.0), ("walk2", 72.0)):
        write_c3d(tmp_path / f"{name}.c3d", POINTS * (1 + 0.1 * mass), LABELS, PROCESSING__Bodymass=[mass])
    subject = open_subject(tmp_path)
    assert subject.mass_kg is None
    (said,) = [note for note in subject.notes if "different values of mass" in note]
    assert "60 kg in walk1.c3d" in said
    assert "72 kg in walk2.c3d" in said


def test_our_own_export_states_them(tmp_path):
    markers = Markers(tuple(LABELS), POINTS / 1000, 100.0)
    export_c3d(tmp_path / "walk.c3d", C3dRecording(markers, subject="Zoë", mass_kg=71.5, height_m=1.82))
    stated = stated_person(tmp_path / "walk.c3d")
    assert (stated.names, stated.mass_kg, stated.height_m) == ({"Zoë"}, 71.5, pytest.approx(1.82))


def test_a_file_that_is_cut_off_states_nothing(write_c3d, tmp_path):
    whole = write_c3d(tmp_path / "a.c3d", POINTS, LABELS, PROCESSING__Bodymass=[27.7])
    data = whole.read_bytes()
    for bytes_left in range(0, 2000, 97):
        whole.write_bytes(data[:bytes_left])
        assert replace(stated_person(whole), names=frozenset()).mass_kg in (None, pytest.approx(27.7))
