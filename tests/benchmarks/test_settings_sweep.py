"""One setting at a time at half and double, and what is said of the answers."""

from dataclasses import asdict, fields, replace

import pytest

from benchmarks.settings_sweep import (
    CHANCE,
    LOOK,
    NOTHING,
    STANDS,
    better_twice,
    changed_numbers,
    changes,
    sorted_settings,
    watched,
)
from solver.settings import Settings, tables

USUAL = {"frames": 60.0, "force_N": 20.0, "moment_Nm": 10.0, "angles_deg": 0.0}
NAME = "trajectory.gain_std"


def answers(name=NAME, half=None, double=None):
    """Of two recordings, of which the second never changes."""
    told = [{"setting": "usual", "factor": 1.0, "figures": {"a": USUAL, "b": USUAL}}]
    for factor, of in ((0.5, half), (2.0, double)):
        figures = {"a": {**USUAL, **(of or {})}, "b": USUAL}
        told.append({"setting": name, "factor": factor, "figures": figures})
    return told


def test_each_change_leaves_all_other_settings_alone():
    usual, all_changes = dict(tables(Settings())), list(changes())
    for change in all_changes[:: len(all_changes) // 40]:
        for table, stage in tables(change.settings):
            for field in fields(stage):
                value, before = getattr(stage, field.name), getattr(usual[table], field.name)
                if (table, field.name) == (change.table, change.key):
                    assert value == change.value != before
                elif not hasattr(value, "__dataclass_fields__"):
                    assert value == before


def test_no_setting_of_the_diagnosis_is_varied_and_each_other_number_twice_or_once():
    names = [change.name for change in changes()]
    assert not [name for name in names if name.startswith("diagnosis")]
    assert {names.count(name) for name in names} <= {1, 2}
    assert NAME in names


def test_constants_of_what_a_fit_uses_are_varied_twice_and_none_of_the_diagnosis():
    names = [change.name for change in changed_numbers()]
    assert {names.count(name) for name in names} == {2}
    assert "kinematics/flat_foot.py LOW_M" in names
    assert not [name for name in names if name.startswith(("effects", "diagnosis", "simulate"))]


@pytest.mark.parametrize(
    ("half", "double", "kind"),
    [
        ({}, {}, NOTHING),
        ({"angles_deg": 0.04}, {"force_N": 20.1}, NOTHING),
        ({"angles_deg": 0.2}, {}, STANDS),
        ({"frames": 59.0}, {}, STANDS),
        ({}, {"force_N": 26.0, "moment_Nm": 13.0}, STANDS),
        ({"force_N": 19.0}, {}, STANDS),  # 5 % of one figure of one recording of two: 1.25 % of all
        ({"force_N": 18.0, "moment_Nm": 9.0}, {"force_N": 30.0}, LOOK),
    ],
)
def test_a_setting_stands_unless_half_or_double_is_better(half, double, kind):
    found = sorted_settings(answers(half=half, double=double))
    assert {k: [name for name, _ in rows] for k, rows in found.items() if rows} == {kind: [NAME]}


@pytest.mark.parametrize(("elsewhere", "kind"), [(18.0, LOOK), (19.9, STANDS), (22.0, STANDS)])
def test_what_is_better_asks_for_a_look_only_if_it_is_so_on_other_windows_too(elsewhere, kind):
    better = {"force_N": 18.0, "moment_Nm": 9.0}
    again = answers(half={"force_N": elsewhere, "moment_Nm": elsewhere / 2}, double={"force_N": 15.0})
    found = sorted_settings(answers(half=better, double={"force_N": 30.0}), again)
    assert [k for k, rows in found.items() if rows] == [kind]
    ((_, words),) = found[kind]
    assert words.count("elsewhere × 0.5") == words.count("elsewhere × 2") == 1


PEOPLE = {f"person {k}": USUAL for k in range(8)} | {"nothing withheld": {**USUAL, "force_N": float("nan")}}


@pytest.mark.parametrize(("better_for", "kind"), [(8, LOOK), (4, CHANCE)])
def test_what_is_better_twice_asks_for_a_look_if_it_is_beyond_chance_for_other_persons(better_for, kind):
    better, elsewhere = {"force_N": 18.0, "moment_Nm": 9.0}, {"force_N": 17.0, "moment_Nm": 8.5}
    both = [answers(half=of, double={"force_N": 30.0}) for of in (better, elsewhere)]
    others = {
        name: {**of, "force_N": of["force_N"] * (0.9 if k < better_for else 1.1)}
        for k, (name, of) in enumerate(PEOPLE.items())
    }
    persons = [
        {"setting": "usual", "factor": 1.0, "figures": PEOPLE},
        {"setting": NAME, "factor": 0.5, "figures": others},
    ]
    assert better_twice(*both) == [(NAME, 0.5)]
    found = sorted_settings(*both, persons)
    assert [k for k, rows in found.items() if rows] == [kind]
    ((_, words),) = found[kind]
    assert f"other persons × 0.5: better for {better_for} of 8 that differ" in words


def test_the_figures_are_told_and_what_is_refused():
    told = answers(half={"force_N": 24.0, "moment_Nm": 12.0, "angles_deg": 0.31, "frames": 58.0})
    told[2] = {"setting": NAME, "factor": 2.0, "refused": "at most 1"}
    ((name, words),) = sorted_settings(told)[STANDS]
    assert name == NAME
    assert words == "× 0.5: +10.0 %, 0.31°, -2 frames; × 2: refused"


def test_a_setting_with_one_answer_of_two_waits():
    assert not any(sorted_settings(answers()[:2]).values())


def test_to_be_read_or_copied_is_a_use_and_to_be_hashed_or_written_down_is_none():
    settings = Settings()
    with watched() as used:
        assert hash(settings) == hash(Settings())
        asdict(settings)
        replace(settings.cleaning)
        assert settings.trajectory.gain_std
    names = {(kind.__name__, name) for kind, name in used}
    assert ("TrajectorySettings", "gain_std") in names
    assert ("TrajectorySettings", "smoothness") not in names
    assert {name for kind, name in names if kind == "MarkerCleaningSettings"} == {
        field.name for field in fields(settings.cleaning)
    }
    assert type(settings.trajectory).__getattribute__ is object.__getattribute__
