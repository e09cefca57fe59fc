"""Constants of the diagnosis, halved and doubled: which are asked, of which cases, and where they stand."""

import json

import pytest

from benchmarks import diagnosis_constants
from benchmarks.diagnosis_constants import (
    CHOICE,
    LOOK,
    NOTHING,
    OTHERS,
    REFUSED,
    STANDS,
    Cases,
    heading,
    page,
    questions,
)
from benchmarks.varied import Answer

NAN = float("nan")


def answer(factor, lost, changed, of=10, name="effects/drag.py LEAST_N"):
    return Answer(name, factor, lost, changed, of)


def test_a_constant_stands_unless_another_value_gives_right_names_more():
    assert heading(answer(0.5, 0.0, 0.0), answer(2.0, 0.0, 0.0)) == NOTHING
    assert heading(answer(0.5, 0.3, 0.1), answer(2.0, 0.0, 0.0)) == STANDS
    assert heading(answer(0.5, -0.01, 0.1), answer(2.0, 0.2, 0.3)) == STANDS
    assert heading(answer(0.5, 0.1, 0.1), answer(2.0, -0.03, 0.3)) == LOOK
    assert heading(answer(0.5, NAN, NAN, 0), answer(2.0, 0.1, 0.3)) == STANDS
    assert heading(answer(0.5, NAN, NAN, 0), answer(2.0, 0.0, 0.0)) == STANDS
    assert heading(answer(0.5, NAN, NAN, 0), answer(2.0, NAN, NAN, 0)) == REFUSED


def test_the_page_says_of_each_what_changes():
    told = page([answer(0.5, 0.05, 0.2), answer(2.0, -0.031, 0.5), answer(0.5, 0.0, 0.0, name="unasked")], 56)
    assert "56 cases" in told
    row = (
        "| `effects/drag.py` | `LEAST_N` | × 0.5: -5.0 %, 2 of 10 otherwise; × 2: +3.1 %, 5 of 10 otherwise |"
    )
    assert row in told.split("## Asks for a look: 1")[1]
    assert "unasked" not in told
    settings = page([answer(f, NAN, NAN, 0, "DiagnosisSettings.block_s") for f in (0.5, 2.0)], 56)
    row = "| `diagnosis.block_s` | `DiagnosisSettings.block_s` | × 0.5: no answer; × 2: no answer |"
    assert row in settings.split("## Cannot be so: 1")[1]


@pytest.fixture
def cases(tmp_path, monkeypatch):
    groups = ["inside"] * 20 + ["outside"] * 8 + ["clean"] * 8
    hidden = {0: "drag", 7: "plate_clock"}
    (tmp_path / "truth").mkdir()
    for k, group in enumerate(groups):
        effects = [{"id": hidden.get(k, "subject_mass")}] if group == "inside" else []
        truth = {"case": f"case_{k:04d}", "group": group, "effects": effects, "accepted": ["none"]}
        (tmp_path / "truth" / f"case_{k:04d}.json").write_text(json.dumps(truth))
    usual = {f"case_{k:04d}": {"drag": 0.3 * (k == 19), "clock_offset": 0.0} for k in range(len(groups))}
    (tmp_path / "usual.json").write_text(json.dumps(usual))
    monkeypatch.setattr(diagnosis_constants, "make", lambda *_: None)
    return Cases(tmp_path)


def test_a_cause_is_asked_about_its_own_cases_its_rivals_and_some_others(cases):
    asked = {q.name: q for q in questions(cases)}
    drag = asked["effects/drag.py ABOUT"]
    assert {"case_0000", "case_0019"} <= set(drag.cases)
    assert len(drag.cases) <= 2 + sum(OTHERS.values())
    assert "case_0007" in asked["effects/plate_clock.py LEAST_S"].cases
    assert "case_0007" not in drag.cases
    assert len(asked["DiagnosisSettings.block_s"].cases) == sum(CHOICE.values())


def test_every_tuned_constant_of_effects_and_diagnosis_is_asked_twice(cases):
    found = list(questions(cases))
    names = [q.name for q in found]
    assert sorted(names) == sorted([name for name in set(names) for _ in range(2)])
    assert {"effects/plate_gain.py ABOUT", "DiagnosisSettings.outside_odds"} <= set(names)
    assert any(name.startswith("diagnosis/") for name in names)
    assert "effects/plate_turn.py TURNS_DEG" not in names
    assert not any(name.startswith(("kinematics", "capture")) for name in names)


def test_what_acts_before_the_search_is_asked_from_the_files(cases):
    from_files = {q.name for q in questions(cases) if q.from_the_files}
    assert "effects/marker_slip.py LEAST_M" in from_files
    assert "DiagnosisSettings.force_noise_N" in from_files
    assert "DiagnosisSettings.rival_margin" not in from_files
    assert "effects/drag.py LEAST_N" not in from_files
