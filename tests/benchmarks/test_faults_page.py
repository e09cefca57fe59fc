"""The page of known faults: a run, and other draws told after it with what is to say of them."""

import json

import pytest

from benchmarks.faults import page as module
from benchmarks.faults.page import load, page

TRUTH = {"kind": "other_mass", "source": "walk", "plate": None, "markers": [], "times_s": None, "size": {}}
NAMED = {"id": "subject_mass", "target": "all", "confidence": 0.8, "parameters": {}, "frames": []}


@pytest.fixture
def draw(tmp_path):
    """A folder of one case, answered with these effects."""

    def made(name, effects):
        out = tmp_path / name
        for part in ("truth", "results"):
            (out / part).mkdir(parents=True)
        (out / "cases.json").write_text(json.dumps({"seed": 7, "code": f"code of {name}"}))
        truth = TRUTH | {"case": "case_000", "what": "78 kg were entered"}
        (out / "truth" / "case_000.json").write_text(json.dumps(truth))
        figures = {"effects": effects, "verdict": "explained", "notes": [], "trials": ["t"]}
        figures |= {"rates_Hz": {"t": 100.0}, "starts_s": {"t": 0.0}}
        answer = {"diagnosis": figures, "error": "", "seconds_cpu": 3.0}
        (out / "results" / "case_000.json").write_text(json.dumps(answer))
        return out

    return made


def test_a_name_that_the_recording_gets_left_alone_as_well_is_marked(draw):
    out = draw("first", [NAMED, NAMED | {"id": "drag", "target": "torso"}])
    assert [v.also_alone for v in load(out)] == [False]
    truth = json.loads((out / "truth" / "case_000.json").read_text()) | {"case": "case_001", "kind": "clean"}
    (out / "truth" / "case_001.json").write_text(json.dumps(truth))
    for effects, marked in (([NAMED], False), ([NAMED | {"id": "drag", "target": "torso"}], True)):
        answer = json.loads((out / "results" / "case_000.json").read_text())
        answer["diagnosis"]["effects"] = effects
        (out / "results" / "case_001.json").write_text(json.dumps(answer))
        assert next(v for v in load(out) if v.case == "case_000").also_alone == marked


@pytest.mark.parametrize(("told_apart", "outcome"), [(False, "right"), (True, "class")])
def test_a_class_that_the_recording_cannot_part_is_right(draw, monkeypatch, told_apart, outcome):
    monkeypatch.setattr(module, "undecidable", lambda out, truth, figures: not told_apart)
    (verdict,) = load(draw("first", [NAMED | {"id": "carried_mass"}]))
    assert (verdict.outcome, verdict.as_a_class) == (outcome, not told_apart)


def test_another_draw_stands_after_the_first_with_its_code_and_note(draw, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "SOURCES", ())
    first, other = draw("first", [NAMED]), draw("other", [])
    (other / "note.txt").write_text("Kinds whose causes had changed.\n")
    alone, both = page(first, tmp_path), page(first, tmp_path, [other])
    assert both.startswith(alone)
    told = both[len(alone) :]
    assert "code of other: 1 of 1 cases" in told
    assert "Kinds whose causes had changed." in told
    assert "| faults: right | 100 %" in alone
    assert "| faults: right | 0 %" in told
