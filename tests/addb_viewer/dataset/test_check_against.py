"""What a release has otherwise than another is told, and nothing is where it is the same."""

import json
import shutil

import pyarrow.parquet as pq
import pytest

from addb_viewer.dataset.build import build, planned
from addb_viewer.dataset.check.against import TOLERANCES, differences
from addb_viewer.dataset.release_subject import BuildOptions
from addb_viewer.dataset.release_tables import TABLES
from tests.addb_viewer.dataset.builds import TERMS, Here
from tests.addb_viewer.dataset.test_check import FRAMES, TRIAL, change
from tests.addb_viewer.shell import run


@pytest.fixture
def copy(release, tmp_path):
    shutil.copytree(release, tmp_path / "copy")
    return tmp_path / "copy"


def added(by, row=30):
    return lambda values: [v + by if k == row else v for k, v in enumerate(values)]


def told(now, before):
    return [(one.level.value, one.where, one.said) for one in differences(now, before)]


def test_a_release_is_the_same_as_its_copy(release, copy):
    assert told(release, copy) == []
    shown = run("dataset", "check", release, "--against", copy)
    assert (shown.exit_code, shown.output.splitlines()[-1]) == (1, "1 error, 0 warnings")  # one walk, twice
    assert "[against]" not in shown.output


def test_last_digits_are_no_difference_and_more_is(release, copy):
    change(copy, FRAMES, tau_knee_angle_r=added(0.01))
    assert told(release, copy) == []
    change(copy, FRAMES, tau_knee_angle_r=added(0.5))
    change(copy, FRAMES, com_y_m=added(0.0005))
    ((level, where, said),) = told(release, copy)
    assert (level, where) == ("error", TRIAL)
    assert said.startswith("frames: tau_knee_angle_r is ")
    assert said.endswith(" N*m, apart on 1 of 121 rows; 1 more columns")
    shown = run("dataset", "check", copy, "--against", release)
    assert shown.exit_code == 1
    assert f"error: {TRIAL}: frames: tau_knee_angle_r" in shown.output


def test_other_words_nulls_and_rows_are_told(release, copy):
    change(copy, FRAMES, activity=lambda values: ["run", *values[1:]])
    assert told(release, copy) == [("error", TRIAL, "frames: activity is walk, there run, on 1 of 121 rows")]
    change(copy, FRAMES, cop_l_x_m=lambda values: [None] * len(values))
    assert "frames: cop_l_x_m is null on other rows; 1 more columns" in told(release, copy)[0][2]
    table = pq.read_table(copy / FRAMES)
    pq.write_table(table.slice(3), copy / FRAMES)
    assert "frames has 121 rows, there 118, or other keys" in told(release, copy)[0][2]


def test_what_came_and_what_went_with_its_reason(release, walks, fitted, tmp_path):
    options = BuildOptions(TERMS, unreviewed=True, without=("Lab/at_200",))
    build(planned([walks], options), tmp_path / "less", options, Here())
    now = told(tmp_path / "less", release)
    assert all(level == "warning" for level, _, _ in now)
    assert {(where, said) for _, where, said in now} == {
        ("Lab/at_200", "is gone, 121 frames"),
        ("subject withdrawn", "withdrawn, there not left out"),
        ("manifest.json", "options without is 1, there 0"),
    }
    assert ("Lab/at_200", "is new, 121 frames") in {
        (where, said) for _, where, said in told(release, tmp_path / "less")
    }


def test_other_programs_settings_and_files_are_told(release, copy):
    manifest = json.loads((copy / "manifest.json").read_text())
    manifest["created_with"]["numpy"] = "1.0"
    subject = manifest["subjects"]["Lab/at_100"]
    subject["settings"] = "0"
    subject["inputs"]["subject.toml"] = "0"
    (copy / "manifest.json").write_text(json.dumps(manifest))
    said = [said for _, _, said in told(release, copy)]
    assert any(words.startswith("created_with numpy is ") and words.endswith("there 1.0") for words in said)
    assert "was fitted with other settings" in said
    assert "was made from other files: subject.toml" in said


def test_every_unit_of_the_frames_has_a_tolerance():
    frames = next(table for table in TABLES if table.name == "frames")
    units = {column.unit for column in frames.columns if column.kind in ("f32", "floats")}
    assert units <= set(TOLERANCES)
