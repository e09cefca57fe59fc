"""What counts as another answer when two searches of one case are compared."""

from copy import deepcopy

import pytest

from benchmarks.diagnosis_speed import differences

ANSWER = {
    "verdict": "explained",
    "effects": [
        {
            "id": "clock_offset",
            "target": "all",
            "confidence": 0.98,
            "parameters": {"offset_s": {"value": 0.012, "std": 0.001}},
        }
    ],
    "evidence_nats": 120.0,
    "alternatives": [{"id": "sample_rate", "target": "all"}],
    "remaining": {"location": None, "off_the_list": None},
}


def test_an_answer_differs_in_nothing_from_itself():
    assert differences(ANSWER, deepcopy(ANSWER)) == []


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda a: a.update(verdict="clean"), "verdict explained → clean"),
        (lambda a: a["effects"].clear(), "no longer named: clock_offset all"),
        (lambda a: a["effects"].append({**a["effects"][0], "id": "drag"}), "newly named: drag all"),
        (lambda a: a.update(evidence_nats=125.0), "evidence 120.0 nats +5.0"),
        (lambda a: a["effects"][0].update(confidence=0.9), "clock_offset all: confidence 0.980 → 0.900"),
        (lambda a: a["effects"][0]["parameters"]["offset_s"].update(value=0.013), "0.012 ± 0.001 → 0.013"),
        (lambda a: a["alternatives"].clear(), "could also be"),
        (lambda a: a["remaining"].update(location={"body": "torso"}), "left over at None → torso"),
    ],
)
def test_every_change_of_an_answer_is_told(change, told):
    after = deepcopy(ANSWER)
    change(after)
    (said,) = differences(ANSWER, after)
    assert told in said
