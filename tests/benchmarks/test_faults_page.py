"""The section of known faults: a draw, and what is to say of it."""

import json

import pytest

from benchmarks.faults import page as module
from benchmarks.faults.page import load, section

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


def test_the_section_counts_what_is_right_and_holds_the_note(draw, monkeypatch):
    monkeypatch.setattr(module, "SOURCES", ())
    first, other = draw("first", [NAMED]), draw("other", [])
    (other / "note.txt").write_text("Kinds whose causes had changed.\n")
    told = section(other)
    assert "code of other: 1 of 1 cases" in told
    assert "Kinds whose causes had changed." in told
    assert "| faults: right | 100 %" in section(first)
    assert "| faults: right | 0 %" in told
