import pytest

from solver.common.errors import CaptureError
from solver.markers.mapping_file import read_map, write_map
from solver.markers.understanding import understand

LABELS = ["LASI", "RASI", "SACR", "LKNE", "RKNE", "LANK", "RANK", 'odd "name"', "M1"]


def test_what_is_written_is_read_again(tmp_path):
    file = tmp_path / "markers.toml"
    understood = understand(LABELS)
    write_map(file, understood, {})
    read = read_map(file)
    assert list(read) == LABELS
    assert read["LASI"] == "asis_l"
    assert read["M1"] == ""
    assert "anterior superior iliac spine" in file.read_text()


def test_a_persons_word_stays(tmp_path):
    file = tmp_path / "markers.toml"
    understood = understand(LABELS)
    write_map(file, understood, {"M1": "knee_medial_r", "gone": "c7"})
    assert read_map(file)["M1"] == "knee_medial_r"
    assert read_map(file)["gone"] == "c7"


@pytest.mark.parametrize(
    "text", ["[markers\n", "[other]\na = 'b'\n", "[markers]\nLASI = 3\n", "markers = 1\n"]
)
def test_broken_files_are_named(tmp_path, text):
    file = tmp_path / "markers.toml"
    file.write_text(text)
    with pytest.raises(CaptureError, match=r"markers\.toml"):
        read_map(file)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(CaptureError, match=r"nowhere\.toml"):
        read_map(tmp_path / "nowhere.toml")


def test_with_a_model_of_ones_own_lines_name_its_markers_and_the_others_are_comments(tmp_path):
    file = tmp_path / "markers.toml"
    write_map(file, understand(LABELS), {"M1": "PELVIS3"}, {"LASI": "L.ASIS"})
    assert read_map(file) == {"LASI": "L.ASIS", "M1": "PELVIS3"}
    assert "RKNE" in file.read_text()
