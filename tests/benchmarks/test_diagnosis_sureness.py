"""How sure named causes are: right ones, wrong ones and surely wrong ones of synthetic answers."""

from benchmarks.diagnosis.sureness import namings, sureness


def effect(id, confidence, target="all"):
    return {"id": id, "target": target, "confidence": confidence}


def hidden(id, target="all"):
    return {"id": id, "target": target, "same_as": [], "frames": None, "parameters": {}}


def case(name, kind, effects, *found):
    return {"case": name, "kind": kind, "effects": effects}, {"effects": list(found)}


def test_a_cause_is_right_that_was_hidden_and_nothing_is_right_where_nothing_was():
    pair = case("a", "pair", [hidden("drag"), hidden("subject_mass")], effect("drag", 0.9), effect("x", 0.2))
    assert [n.right for n in namings(*pair)] == [True, False]
    assert not namings(*case("b", "unknown", [hidden("drag")], effect("drag", 0.6)))[0].right
    assert namings({"case": "c", "kind": "clean", "effects": []}, None) == []


def test_surely_wrong_cases_are_counted_of_all_and_named():
    text = sureness(
        [
            case("one", "single", [hidden("drag")], effect("drag", 0.99)),
            case("two", "clean", [], effect("drag", 0.98)),
            case("three", "clean", []),
            case("four", "clean", []),
        ]
    )
    assert "(1/4): two." in text
    assert "50 % [" in text
    assert "2 named causes" in text


def test_the_calibration_error_is_the_gap_between_what_is_said_and_what_is_right():
    said = [
        case(str(k), "single", [hidden("drag")], effect("drag" if k < 5 else "x", 0.75)) for k in range(10)
    ]
    assert "0.250" in sureness(said)
