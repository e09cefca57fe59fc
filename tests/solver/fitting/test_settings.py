"""Settings: the printed file reads back, and a slip of the pen is named with its correct."""

import json
import tomllib
from dataclasses import fields, is_dataclass, replace

import pytest

from solver.common.errors import SettingsError
from solver.fitting.settings import (
    FILE_NAME,
    Settings,
    as_dict,
    as_toml,
    by_name,
    decide_the_same_fit,
    from_dict,
    read_settings,
    settings_for,
    tables,
)

STAGES = [
    (name, f)
    for name, table in tables(Settings())
    for f in fields(table)
    if not is_dataclass(getattr(table, f.name))
]


def number_in(value):
    """Whether a setting's value is a number, or a list with numbers."""
    if isinstance(value, tuple):
        return any(number_in(item) for item in value)
    return isinstance(value, int | float) and not isinstance(value, bool)


def with_all(value, number):
    """A value as TOML, every number of it replaced."""
    if isinstance(value, tuple):
        return f"[{', '.join(with_all(item, number) for item in value)}]"
    return json.dumps(value) if isinstance(value, str) else number


def written(folder, text):
    path = folder / FILE_NAME
    path.write_text(text, encoding="utf-8")
    return path


def test_the_printed_defaults_are_the_defaults(tmp_path):
    assert read_settings(written(tmp_path, as_toml(Settings()))) == Settings()


@pytest.mark.parametrize(("stage", "f"), STAGES, ids=[f"{stage}.{f.name}" for stage, f in STAGES])
def test_every_setting_is_printed_with_the_reason_beside_it(stage, f):
    table = as_toml(Settings()).split(f"[{stage}]\n")[1].split("\n[")[0].splitlines()
    place = next(i for i, line in enumerate(table) if line.removeprefix("# ").startswith(f"{f.name} ="))
    assert table[place - 1].startswith("# ")
    assert f.metadata["why"] in table[place - 1]
    assert f.metadata["unit"] in table[place - 1]


@pytest.mark.parametrize(("stage", "f"), STAGES, ids=[f"{stage}.{f.name}" for stage, f in STAGES])
def test_every_setting_has_a_reason(stage, f):
    assert len(f.metadata.get("why", "")) > 10, (
        f"[{stage}] {f.name}: declare it with solver.common.settings_field.setting"
    )


def test_a_file_changes_what_it_names_and_nothing_else(tmp_path):
    changed = read_settings(written(tmp_path, "[kinematics]\nmarker_std_m = 0.02\niterations = 7\n"))
    expected = replace(Settings().kinematics, marker_std_m=0.02, iterations=7)
    assert changed == replace(Settings(), kinematics=expected)
    assert as_dict(changed)["kinematics"]["iterations"] == 7


def test_whole_numbers_pass_for_numbers(tmp_path):
    value = read_settings(written(tmp_path, "[kinematics]\nmarker_std_m = 1\n")).kinematics.marker_std_m
    assert isinstance(value, float)
    assert value == 1.0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[kinematic]\n", r"unknown table \[kinematic\]; nearest: kinematics"),
        ("[xyz]\n", r"unknown table \[xyz\]; known: .*kinematics"),
        (
            "[kinematics]\nmarker_std = 0.01\n",
            r"unknown setting 'marker_std' in \[kinematics\]; nearest: marker_std_m",
        ),
        (
            "[kinematics]\nmarker_std_m = '1 cm'\n",
            r'marker_std_m = "1 cm": expected a number, as in marker_std_m = 0.01',
        ),
        ("[kinematics]\nmarker_std_m = true\n", "expected a number"),
        ("[kinematics]\nmarker_std_m = nan\n", "expected a number"),
        ("[kinematics]\niterations = 2.5\n", "expected a whole number"),
        ("kinematics = 3\n", "must be a table"),
        ("[diagnosis]\nmarkers = 3\n", r"'markers' in \[diagnosis\] must be a table: \[diagnosis.markers\]"),
        ("[diagnosis.markers]\ntime = 0.2\n", r"'time' in \[diagnosis.markers\]; nearest: time_s"),
        ("[diagnosis]\nhandicaps = [['drag']]\n", "each a list of a text, a number"),
        ("[kinematics\n", "not a TOML file"),
    ],
)
def test_a_slip_is_named_with_the_file_and_the_corrected_by(tmp_path, text, message):
    with pytest.raises(SettingsError, match=message) as error:
        read_settings(written(tmp_path, text))
    assert FILE_NAME in str(error.value)


def test_bytes_that_are_no_text_are_no_settings(tmp_path):
    (tmp_path / FILE_NAME).write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SettingsError, match="not a TOML file"):
        read_settings(tmp_path / FILE_NAME)


def test_a_named_file_comes_before_the_subjects_and_that_before_the_defaults(tmp_path):
    other = tmp_path / "other.toml"
    other.write_text("[kinematics]\niterations = 3\n")
    assert settings_for(tmp_path) == Settings()
    written(tmp_path, "[kinematics]\niterations = 2\n")
    assert settings_for(tmp_path).kinematics.iterations == 2
    assert settings_for(tmp_path, other).kinematics.iterations == 3


def test_the_printed_file_is_toml_with_a_table_a_stage():
    assert set(tomllib.loads(as_toml(Settings()))) == {f.name for f in fields(Settings)}


CHANGED = """
[cleaning]
spike_m = 0.2
[diagnosis]
least_gain = 9
handicaps = [["drag", 4], ["plate_gain", 1.5]]
[diagnosis.markers]
time_s = 0.2
"""


def test_tables_of_diagnosis_and_joining_are_read(tmp_path):
    changed, usual = read_settings(written(tmp_path, CHANGED)), Settings()
    assert changed.reading.cleaning.spike_m == 0.2
    assert changed.diagnosis == replace(
        usual.diagnosis,
        least_gain=9.0,
        handicaps=(("drag", 4.0), ("plate_gain", 1.5)),
        markers=replace(usual.diagnosis.markers, time_s=0.2),
    )


def test_what_a_fit_keeps_is_what_json_gives_back(tmp_path):
    changed = read_settings(written(tmp_path, CHANGED))
    kept = as_dict(changed)
    assert json.loads(json.dumps(kept)) == kept
    assert from_dict(kept) == changed
    assert by_name(kept)["diagnosis.markers.time_s"] == 0.2
    assert from_dict({"kinematics": {"iterations": 7}}).kinematics == replace(
        Settings().kinematics, iterations=7
    )


def test_a_fit_stays_that_of_its_settings_when_only_the_diagnosis_changes():
    usual = Settings()
    kept = as_dict(usual)
    assert decide_the_same_fit(kept, replace(usual, diagnosis=replace(usual.diagnosis, least_gain=9.0)))
    assert not decide_the_same_fit(kept, replace(usual, kinematics=replace(usual.kinematics, iterations=12)))


NUMERIC = [(stage, f) for stage, f in STAGES if number_in(getattr(dict(tables(Settings()))[stage], f.name))]


@pytest.mark.parametrize(("stage", "f"), NUMERIC, ids=[f"{stage}.{f.name}" for stage, f in NUMERIC])
def test_every_number_that_cannot_work_is_refused_with_what_can(tmp_path, stage, f):
    """A setting for which zero or less means something says so where it is declared."""
    usual = getattr(dict(tables(Settings()))[stage], f.name)
    least = f.metadata["bounds"].least
    assert f.metadata["bounds"].allow(usual)
    refused = {"nan", "inf"} | ({"0", "-1"} if least is None else {"-1"} if least == 0.0 else set())
    for number in ("nan", "inf", "0", "-1"):
        written(tmp_path, f"[{stage}]\n{f.name} = {with_all(usual, number)}\n")
        if number in refused:
            with pytest.raises(SettingsError) as error:
                settings_for(tmp_path)
            said = str(error.value)
            assert all(part in said for part in (FILE_NAME, f"[{stage}] {f.name} = ", f"as in {f.name} = "))
            if number in ("0", "-1"):
                assert ("greater than 0" if least is None else "at least 0") in said
        else:
            settings_for(tmp_path)


def test_bounds_above_are_told_too(tmp_path):
    written(tmp_path, "[conditioning]\nnyquist_share = 1\n")
    with pytest.raises(SettingsError, match=r"expected a number greater than 0 and less than 1, as in"):
        settings_for(tmp_path)
