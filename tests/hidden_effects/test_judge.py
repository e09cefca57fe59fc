"""How answers are judged against the truth, and counted by kind and size."""

import pytest

from benchmarks.diagnosis.curves import curves
from benchmarks.diagnosis.judge import Verdict, judged, overlap, parameter_scores
from benchmarks.diagnosis.rates import smallest_found, table, wilson
from benchmarks.diagnosis.score import Scored


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


def answered(id, size, outcome, activity="walk"):
    truth = {"effects": [{"id": id, "size": size}], "world": {"world": {"activity": activity}}}
    return Scored(truth, {}, Verdict("case", "single", outcome))


CASES = [
    *[answered("clock_offset", 0.5, outcome) for outcome in ("right", "missed", "wrong", "class")],
    *[answered("clock_offset", 1.0, "right")] * 4,
    *[answered("drag", 1.0, "missed")] * 4,
    answered("drag", 1.0, "right", "squat"),
    answered("plate_swap", 1.0, "right"),
]


def test_named_and_noticed_are_counted_by_size_and_squats_are_apart():
    told = curves(CASES).splitlines()[2:]
    assert told == [
        "| walk | × 0.5 | 38 % [9, 78] (1.5/4) | 75 % [30, 95] (3/4) |",
        "| walk | × 1 | 50 % [22, 78] (4/8) | 50 % [22, 78] (4/8) |",
        "| squat | × 1 | 100 % [21, 100] (1/1) | 100 % [21, 100] (1/1) |",
    ]


def test_wilsons_interval_against_the_quadratic_it_solves():
    """Its ends are the rates p for which (p̂ − p)² = z² p (1 − p) / n."""
    for hits, count in ((0, 150), (3, 150), (95, 100), (28.5, 30)):
        for end in wilson(hits, count):
            p = hits / count
            assert (p - end) ** 2 == pytest.approx(1.959964**2 * end * (1 - end) / count, abs=1e-12)


def test_two_percent_need_about_a_hundred_and_fifty_clean_recordings_without_an_alarm():
    assert wilson(0, 150)[1] == pytest.approx(0.025, abs=0.001)


def test_the_smallest_size_found_is_found_at_all_larger_ones():
    sizes = [0.5] * 4 + [1.0] * 4 + [1.5] * 4
    assert smallest_found(sizes, [0, 1, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1]) == 1.0
    assert smallest_found(sizes, [1, 1, 1, 1, 0, 1, 1, 1, 1, 1, 1, 1]) == 1.5
    assert smallest_found(sizes, [1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 1, 1]) is None


def test_a_table_is_markdown():
    assert table(["a", "b"], [[1, "x"]]) == "| a | b |\n|---|---|\n| 1 | x |"
