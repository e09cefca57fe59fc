import pytest

from solver.capture.subject.description import read_json, read_toml
from solver.common.errors import CaptureError


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
    assert toml(tmp_path, f'sex = "{word}"').sex("sex") == (sex, ())


def test_a_strange_sex_is_said(tmp_path):
    assert "'x1' counts as unknown" in toml(tmp_path, 'sex = "x1"').sex("sex")[1][0]


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
    assert read_toml(path).sex("sex") == ("male", ())
