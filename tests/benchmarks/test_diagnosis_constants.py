"""Constants of the diagnosis, halved and doubled: which are asked, of which cases, and where they stand."""

import json

import numpy as np
import pytest

from benchmarks import diagnosis_constants
from benchmarks.diagnosis_constants import (
    BEFORE,
    CHOICE,
    LOOK,
    NOTHING,
    OTHERS,
    REFUSED,
    STANDS,
    TOGETHER,
    WITNESSES_SAY,
    Cases,
    all_suspects,
    answered,
    at_work,
    heading,
    page,
    questions,
)
from benchmarks.rewriting import NoAnswerError
from benchmarks.varied import CHANCE, Answer, Evidence
from solver.diagnosis import diagnose
from solver.runs import runs

NAN = float("nan")


def answer(factor, lost, changed, of=10, name="effects/drag.py LEAST_N"):
    return Answer(name, factor, lost, changed, of)


def kind(half, double, of_all=None):
    return heading([half, double], of_all or {})


def test_a_constant_stands_unless_another_value_gives_right_names_more():
    assert kind(answer(0.5, 0.0, 0.0), answer(2.0, 0.0, 0.0)) == NOTHING
    assert kind(answer(0.5, 0.3, 0.1), answer(2.0, 0.0, 0.0)) == STANDS
    assert kind(answer(0.5, -0.01, 0.1), answer(2.0, 0.2, 0.3)) == STANDS
    assert kind(answer(0.5, 0.1, 0.1), answer(2.0, -0.03, 0.3)) == LOOK
    assert kind(answer(0.5, NAN, NAN, 0), answer(2.0, 0.1, 0.3)) == STANDS
    assert kind(answer(0.5, NAN, NAN, 0), answer(2.0, 0.0, 0.0)) == STANDS
    assert kind(answer(0.5, NAN, NAN, 0), answer(2.0, NAN, NAN, 0)) == REFUSED


@pytest.mark.parametrize(
    ("gain", "q", "where"), [(0.1, 0.02, LOOK), (0.1, 0.3, CHANCE), (0.1, None, CHANCE), (-0.1, None, STANDS)]
)
def test_what_is_better_on_few_cases_stands_as_all_cases_tell(gain, q, where):
    half, double = answer(0.5, 0.1, 0.1), answer(2.0, -0.03, 0.3)
    assert kind(half, double, {(double.setting, 2.0): Evidence(1, 2, gain, 0.25, q)}) == where


def test_the_page_says_of_each_what_changes():
    told = page(
        [answer(0.5, 0.05, 0.2), answer(2.0, -0.031, 0.5), answer(0.5, 0.0, 0.0, name="unasked")],
        [Answer("effects/drag.py LEAST_N", 2.0, -0.01, 2 / 56, 56, {"one": -0.015, "other": 0.005})],
        56,
    )
    assert "56 cases" in told
    row = (
        "| `effects/drag.py` | `LEAST_N` | × 0.5: -5.0 %, 2 of 10 otherwise; × 2: +3.1 %, 5 of 10 otherwise "
        "(all cases × 2: +1.0 %, 2 of 56 otherwise, better for 1 of 2 that differ, p 50.0 %) |"
    )
    assert row in told.split("## May be chance: 1")[1]
    assert "unasked" not in told
    block_s, told_nats = "DiagnosisSettings.block_s", "WitnessSettings.told_nats"
    names = (f"diagnosis_settings.py {block_s}", f"diagnosis/witnesses/settings.py {told_nats}")
    settings = page([answer(f, NAN, NAN, 0, name) for name in names for f in (0.5, 2.0)], [], 56)
    refused = settings.split("## Cannot be so: 2")[1]
    assert f"| `diagnosis.block_s` | `{block_s}` | × 0.5: no answer; × 2: no answer |" in refused
    assert f"| `diagnosis/witnesses/settings` | `{told_nats}` |" in refused


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
    used = {
        BEFORE: ["effects/marker_slip.py", "DiagnosisSettings.force_noise_N"],
        WITNESSES_SAY: ["effects/contact_edges.py"],
    }
    (tmp_path / "at_work.json").write_text(json.dumps(used))
    monkeypatch.setattr(diagnosis_constants, "make", lambda *_: None)
    return Cases(tmp_path)


def test_a_cause_is_asked_about_its_own_cases_its_rivals_and_some_others(cases):
    asked = {q.name: q for q in questions(cases)}
    drag = asked["effects/drag.py ABOUT"]
    assert {"case_0000", "case_0019"} <= set(drag.cases)
    assert len(drag.cases) <= 2 + sum(OTHERS.values())
    assert "case_0007" in asked["effects/plate_clock.py LEAST_S"].cases
    assert "case_0007" not in drag.cases
    assert len(asked["diagnosis_settings.py DiagnosisSettings.block_s"].cases) == sum(CHOICE.values())


def test_every_tuned_constant_of_effects_and_diagnosis_is_asked_twice(cases):
    found = list(questions(cases))
    names = [q.name for q in found]
    assert sorted(names) == sorted([name for name in set(names) for _ in range(2)])
    settings = {
        "diagnosis_settings.py DiagnosisSettings.outside_odds",
        "diagnosis/witnesses/settings.py WitnessSettings.place_scatter_m",
        "dynamics/marker_noise.py MarkerNoise.smoothness",
    }
    assert {"effects/plate_gain.py ABOUT", *settings} <= set(names)
    assert any(name.startswith("diagnosis/") for name in names)
    assert "effects/plate_turn.py TURNS_DEG" not in names
    assert not any(name.startswith(("kinematics", "capture")) for name in names)


def test_what_is_kept_is_made_anew_where_a_number_is_at_work_in_it(cases):
    anew = {q.name: q.anew for q in questions(cases)}
    assert anew["effects/marker_slip.py LEAST_M"] == (BEFORE,)
    assert anew["diagnosis_settings.py DiagnosisSettings.force_noise_N"] == (BEFORE,)
    assert anew["effects/contact_edges.py SOUND"] == (WITNESSES_SAY,)
    assert anew["diagnosis/witnesses/settings.py WitnessSettings.told_nats"] == (WITNESSES_SAY,)
    assert anew["diagnosis_settings.py DiagnosisSettings.rival_margin"] == ()
    assert anew["effects/drag.py LEAST_N"] == ()


def test_what_is_at_work_before_the_search_is_seen_and_the_first_fit_is_made_once(tmp_path, monkeypatch):
    fitted = []

    def solve(*_, captures):
        fitted.append(captures)
        return "a fit"

    def looked_at(subject, settings, **_):
        fits = [diagnose.solve(subject, settings, captures=of) for of in ({}, {"trial": "repaired"})]
        assert fits == ["a fit", "a fit"]
        return runs(np.array([settings.diagnosis.model_arm_m > 0]))

    monkeypatch.setattr(diagnose, "solve", solve)
    monkeypatch.setattr(diagnosis_constants, "looked_at", looked_at)
    monkeypatch.setattr(diagnosis_constants, "open_subject", lambda *_: None)
    monkeypatch.setattr(diagnosis_constants, "asked_of", lambda *_: ())
    (tmp_path / "cases" / "one").mkdir(parents=True)
    for _ in range(2):
        used = at_work(tmp_path, ["one"])[BEFORE]
        assert {"runs.py", "DiagnosisSettings.model_arm_m"} <= used
        assert not {"gravity.py", "DiagnosisSettings.model_time_s"} & used
    assert fitted == [{}, {"trial": "repaired"}, {"trial": "repaired"}]
    assert diagnose.solve is solve


def test_what_changes_nothing_together_is_not_asked_alone(cases, monkeypatch):
    asked_of = []

    def told(_, some, of):
        asked_of.append((len(some), len(of)))
        if any(one.name == "effects/drag.py LEAST_N" for one in some):
            return {case: cases.usual[case] | {"drag": 0.9 * (case == "case_0019")} for case in of}
        if len(some) > 1 and some[0].number.file == "effects/plate_clock.py":
            raise NoAnswerError("too short")
        return {case: cases.usual[case] for case in of}

    monkeypatch.setattr(diagnosis_constants, "told", told)
    files = ("effects/drag.py", "effects/plate_clock.py", "effects/leaps.py")
    some = [q for q in questions(cases) if q.number.file in files]
    alone = all_suspects(cases, some, 1)
    of_drag = {alone[q.key] for q in some if q.number.file == files[0]}
    assert of_drag == {("case_0019",)}
    assert {alone[q.key] for q in some if q.number.file == files[2]} == {()}
    assert all(alone[q.key] == q.cases for q in some if q.number.file == files[1])
    assert max(count for count, _ in asked_of) <= TOGETHER
    before = len(asked_of)
    assert all_suspects(cases, some, 1) == alone
    assert len(asked_of) == before
    answers = {q.key: answered(cases, q, alone[q.key]) for q in some}
    least = answers["effects/drag.py LEAST_N", 2.0]
    assert (least.changed * least.of, least.wrong) == (pytest.approx(1), 0.0)
    assert set(least.by_person) == set(some[0].cases)
    assert answers["effects/drag.py ABOUT", 2.0].changed == 0.0
    assert not any(one.changed for one in answers.values() if one.setting.startswith(files[2]))
