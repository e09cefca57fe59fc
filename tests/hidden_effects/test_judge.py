"""How answers are judged against the truth."""

import pytest

from tests.hidden_effects.judging import judged, overlap, parameter_scores


def truth(*effects, kind="single"):
    return {"case": "c", "kind": kind, "effects": list(effects)}


def hidden(id, target, parameters=None, **more):
    return {
        "id": id,
        "target": target,
        "parameters": parameters or {},
        "same_as": [],
        "frames": [],
        "bodies": [],
    } | more


def found(id, target, frames=None, **parameters):
    return {
        "id": id,
        "target": target,
        "parameters": {k: dict(zip(("value", "std"), v, strict=True)) for k, v in parameters.items()},
        "frames": frames or [],
    }


def said(*effects, verdict="explained", alternatives=(), location=None):
    return {
        "verdict": verdict,
        "effects": list(effects),
        "alternatives": list(alternatives),
        "remaining": {"location": location},
    }


GAIN = hidden("plate_gain", "plate_2", {"gain_error": 0.04})


@pytest.mark.parametrize(
    ("answer", "outcome"),
    [
        (said(found("plate_gain", "plate_2")), "right"),
        (said(found("plate_gain", "plate_2"), found("drag", "torso")), "right_but_more"),
        (said(found("plate_gain", "plate_1")), "id_only"),
        (said(found("plate_bias", "plate_2")), "wrong"),
        (said(verdict="unexplained"), "unexplained"),
        (said(verdict="clean"), "missed"),
        (None, "failed"),
        (said(found("subject_mass", "all"), alternatives=[found("plate_gain", "plate_2")]), "class"),
        (
            said(
                found("subject_mass", "all"),
                alternatives=[found("a", "b"), found("c", "d"), found("plate_gain", "plate_2")],
            ),
            "wrong",
        ),
    ],
)
def test_one_hidden_effect(answer, outcome):
    assert judged(truth(GAIN), answer).outcome == outcome


def test_joined_names_count_in_any_order_and_by_any_alias():
    swap = hidden("plate_swap", "plate_1+plate_2")
    assert judged(truth(swap), said(found("plate_swap", "plate_2+plate_1"))).outcome == "right"
    step = hidden("off_plate_step", "plate_1", frames=[[10, 70]], same_as=["calcn_r"])
    assert judged(truth(step), said(found("off_plate_step", "calcn_r", [[12, 68]]))).outcome == "right"
    assert (
        judged(truth(step), said(found("off_plate_step", "calcn_r", [["walk", 12, 68]]))).outcome == "right"
    )
    assert judged(truth(step), said(found("off_plate_step", "calcn_r", [[150, 190]]))).outcome == "id_only"
    assert judged(truth(step), said(found("off_plate_step", "calcn_l", [[12, 68]]))).outcome == "id_only"


def test_clean_ones():
    assert judged(truth(kind="clean"), said(verdict="clean")).outcome == "right"
    assert judged(truth(kind="clean"), said(verdict="unexplained")).outcome == "unexplained"
    assert judged(truth(kind="clean"), said(GAIN)).outcome == "false_alarm"


def test_unknown_ones_need_the_body_where_a_body_can_be_told():
    force = truth(hidden("unknown_x", "hand_r", bodies=["hand_r", "ulna_r"]), kind="unknown")
    assert judged(force, said(verdict="unexplained", location={"body": "ulna_r"})).outcome == "right"
    assert judged(force, said(verdict="unexplained", location={"body": "torso"})).outcome == "wrong_body"
    assert judged(force, said(found("external_contact", "hand_r"))).outcome == "contact"
    assert judged(force, said(found("drag", "torso"))).outcome == "wrong"
    torque = truth(hidden("unknown_torque", "femur_r"), kind="unknown")
    assert judged(torque, said(verdict="unexplained")).outcome == "right"


def test_pairs_need_both():
    slip = hidden("marker_slip", "C7")
    both = said(found("marker_slip", "C7"), found("plate_gain", "plate_2"))
    assert judged(truth(GAIN, slip, kind="pair"), both).outcome == "right"
    assert judged(truth(GAIN, slip, kind="pair"), said(found("marker_slip", "C7"))).outcome == "one"


def near(name, true, value, std, **others):
    (score,) = parameter_scores(
        {"parameters": {name: true} | others}, found("x", "y", **{name: (value, std)})
    )
    return score.near


def test_parameters_are_near_within_a_tenth_or_two_deviations():
    assert near("offset_s", 0.010, 0.0109, 1e-5)
    assert not near("offset_s", 0.010, 0.0115, 1e-5)
    assert near("offset_s", 0.010, 0.0115, 0.001)
    assert near("mass_factor", 1.04, 1.0435, 1e-5)  # a tenth of the four percent, not of the whole
    assert not near("mass_factor", 1.04, 1.05, 1e-5)
    assert near("bias_x_N", 1.0, 2.4, 1e-3, bias_y_N=15.0)  # a tenth of the vector
    assert not near("bias_x_N", 1.0, 2.4, 1e-3, bias_y_N=2.0)


def test_overlap_is_intersection_over_union():
    assert overlap([[0, 10]], [[5, 15]]) == pytest.approx(1 / 3)
    assert overlap([[0, 10]], [["walk", 0, 10]]) == 1.0
