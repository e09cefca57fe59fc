from dataclasses import replace

import numpy as np
import pytest

from solver.capture.capture import Markers
from solver.capture.subject.description import read_json, read_toml, stated_person
from solver.capture.subject.opened_subject import open_subject
from solver.common.errors import CaptureError
from solver.export.c3d_file import C3dRecording
from solver.export.c3d_file import write_c3d as export_c3d

POINTS = np.random.default_rng(1).uniform(0, 1000, (10, 4, 3))
LABELS = ["LASI", "RASI", "LPSI", "RPSI"]


def toml(folder, text):
    path = folder / "subject.toml"
    path.write_text(text, encoding="utf-8")
    return read_toml(path)


@pytest.mark.parametrize(
    ("text", "value"), [("75.7", 75.7), ('"75.7"', 75.7), ('" 75,7 "', 75.7), ("80", 80.0), ('""', None)]
)
def test_numbers_with_and_without_quotes(tmp_path, text, value):
    assert toml(tmp_path, f"mass_kg = {text}").number("mass_kg", "mass") == (value, ())


def test_a_number_that_is_absent_or_zero(tmp_path):
    entries = toml(tmp_path, "height_m = 0")
    assert entries.number("mass_kg", "mass") == (None, ())
    value, notes = entries.number("height_m", "height")
    assert value is None
    assert "counts as unknown" in notes[0]


@pytest.mark.parametrize("text", ['"heavy"', "true", "nan", "inf", "[75]"])
def test_no_number(tmp_path, text):
    with pytest.raises(CaptureError, match=r"mass_kg = .*not a number.*in kg"):
        toml(tmp_path, f"mass_kg = {text}").number("mass_kg", "mass")


def test_centimetres_and_grams_are_noticed(tmp_path):
    entries = toml(tmp_path, "height_m = 180\nmass_kg = 75930")
    with pytest.raises(CaptureError, match=r"height_m = 180: .*in m"):
        entries.number("height_m", "height")
    with pytest.raises(CaptureError, match=r"mass_kg = 75930: .*in kg"):
        entries.number("mass_kg", "mass")


@pytest.mark.parametrize(
    ("word", "sex"), [("male", "male"), ("F", "female"), ("Woman", "female"), ("unknown", None), ("", None)]
)
def test_sex(tmp_path, word, sex):
    assert toml(tmp_path, f'sex = "{word}"').sex() == (sex, ())


def test_a_strange_sex_is_said(tmp_path):
    assert "'x1' counts as unknown" in toml(tmp_path, 'sex = "x1"').sex()[1][0]


def test_texts(tmp_path):
    entries = toml(tmp_path, 'tags = ["a", " b "]\none = "c"\nbad = [1]')
    assert entries.texts("tags") == ("a", "b")
    assert entries.texts("one") == ("c",)
    assert entries.texts("none") is None
    with pytest.raises(CaptureError, match=r"bad = .*list of names"):
        entries.texts("bad")


@pytest.mark.parametrize(
    "name",
    [
        "../../x.trc",
        "a/../../x.trc",
        "/etc/passwd",
        "C:\\x.trc",
        "..\\..\\x.trc",
        ".././../x.trc",
        "\\\\host\\x",
    ],
)
def test_paths_out_of_the_folder_are_refused(tmp_path, name):
    (tmp_path / "x.trc").write_text("")
    inner = tmp_path / "middle" / "inner"
    inner.mkdir(parents=True)
    with pytest.raises(CaptureError, match="leads out of the subject's folder"):
        toml(inner, f"static = '{name}'").file("static")


@pytest.mark.parametrize("name", ["../x.trc", "..\\x.trc", "../Markers/y.trc"])
def test_files_beside_the_folder_are_found(tmp_path, name):
    (tmp_path / "Markers").mkdir()
    (tmp_path / "inner").mkdir()
    file = tmp_path / name.replace("\\", "/").removeprefix("../")
    file.write_text("")
    assert toml(tmp_path / "inner", f"static = '{name}'").file("static") == file
    with pytest.raises(
        CaptureError, match=r"no such file. Is it 'x\.trc'" if "x" in name else "no such file"
    ):
        toml(tmp_path / "inner", "static = '../xx.trc'").file("static")


def test_paths_with_spaces_accents_and_backslashes(tmp_path):
    (tmp_path / "Läufe é").mkdir()
    file = tmp_path / "Läufe é" / "trial 1.trc"
    file.write_text("")
    for name in ("Läufe é/trial 1.trc", "Läufe é\\trial 1.trc", "./Läufe é/trial 1.trc"):
        assert toml(tmp_path, f"static = '{name}'").file("static") == file


def test_a_missing_file_with_its_nearest_name(tmp_path):
    (tmp_path / "static1.trc").write_text("")
    with pytest.raises(
        CaptureError, match=r"static = \"static_1\.trc\": there is no such file. Is it 'static1\.trc'"
    ):
        toml(tmp_path, 'static = "static_1.trc"').file("static")


def test_unknown_keys_with_the_nearest_known(tmp_path):
    notes = toml(tmp_path, "mas_kg = 70\ncolour = 1").unknown(("mass_kg", "sex"))
    assert "mas_kg (mass_kg?)" in notes[0]
    assert "colour" in notes[0]


def test_broken_toml_says_where(tmp_path):
    with pytest.raises(CaptureError, match=r"subject\.toml: .*line 2"):
        toml(tmp_path, "mass_kg = 70\nheight_m 1.8\n")


def test_broken_json_says_where(tmp_path):
    path = tmp_path / "_subject.json"
    path.write_text('{"massKg": 70,\n "heightM" 1.8}')
    with pytest.raises(CaptureError, match=r"_subject\.json: line 2, column 12"):
        read_json(path)


@pytest.mark.parametrize("text", ["[1, 2]", "3", "null"])
def test_json_that_is_no_object(tmp_path, text):
    path = tmp_path / "_subject.json"
    path.write_text(text)
    with pytest.raises(CaptureError, match="an object in braces"):
        read_json(path)


def test_json_nested_without_end(tmp_path):
    path = tmp_path / "_subject.json"
    path.write_text("[" * 100_000)
    with pytest.raises(CaptureError, match=r"nested|line 1"):
        read_json(path)


def test_text_that_is_not_utf8(tmp_path):
    path = tmp_path / "subject.toml"
    path.write_bytes(b'sex = "m\xe4nnlich"')
    with pytest.raises(CaptureError, match="UTF-8"):
        read_toml(path)


def test_a_byte_order_mark_is_no_letter(tmp_path):
    path = tmp_path / "subject.toml"
    path.write_bytes(b'\xef\xbb\xbfsex = "male"')
    assert read_toml(path).sex() == ("male", ())


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
