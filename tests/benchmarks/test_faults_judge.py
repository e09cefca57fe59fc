"""What counts as right, as a class, as wrong."""

import pytest

from benchmarks.faults.judge import judged, with_seconds

PLATES_FAULT = {
    "case": "c",
    "kind": "half_gain",
    "plate": 1,
    "markers": [],
    "times_s": None,
    "size": {"gain": 0.5},
}


def effect(id, target="plate_1", confidence=0.95, parameters=None, frames=((0, 100),)):
    stated = {n: {"value": v, "std": s} for n, (v, s) in (parameters or {}).items()}
    return {"id": id, "target": target, "confidence": confidence, "parameters": stated, "frames": frames}


def answer(*effects, verdict="explained", notes=()):
    figures = {
        "effects": list(effects),
        "verdict": verdict,
        "notes": [{"text": note} for note in notes],
        "trials": ["trial_a"],
    }
    figures |= {"rates_Hz": {"trial_a": 100.0}, "starts_s": {"trial_a": 0.5}}
    return {"diagnosis": with_seconds(figures), "seconds_cpu": 3.0}


@pytest.mark.parametrize(
    ("effects", "outcome"),
    [
        ([effect("plate_gain", parameters={"gain_error": (-0.48, 0.02)})], "right"),
        ([effect("plate_gain", parameters={"gain_error": (-0.2, 0.02)})], "class"),
        ([effect("plate_gain", "plate_2", parameters={"gain_error": (-0.48, 0.02)})], "wrong"),
        ([effect("plate_bias")], "class"),
        ([effect("elastic_tether", "torso")], "wrong"),
        (
            [
                effect("plate_gain", parameters={"gain_error": (-0.48, 0.02)}),
                effect("external_contact", "hand_r"),
            ],
            "right_but_more",
        ),
        ([], "missed"),
    ],
)
def test_a_fault_of_a_plate(effects, outcome):
    verdict = "explained" if effects else "clean"
    assert judged(PLATES_FAULT, answer(*effects, verdict=verdict)).outcome == outcome


def test_what_is_unexplained_is_neither_wrong_nor_missed():
    assert judged(PLATES_FAULT, answer(verdict="unexplained")).outcome == "unexplained"


@pytest.mark.parametrize(("share", "outcome"), [(0.3, "class"), (0.5, "wrong")])
def test_one_class_with_the_name_of_the_right_plate_is_a_class(share, outcome):
    """The share of the right plate is in that of the class, or the class is of others."""
    said = effect("zero_level", "plate_2", 0.35) | {"in_its_class": 0.7, "told_as": "name"}
    other = {"id": "zero_level", "target": "plate_1", "instead_of": "zero_level plate_2", "confidence": share}
    answered = answer(said)
    answered["diagnosis"]["alternatives"] = [other]
    verdict = judged(PLATES_FAULT, answered)
    assert verdict.outcome == outcome
    assert bool(verdict.beside) == (outcome == "wrong")


def test_a_lead_is_no_name():
    right = effect("plate_gain", parameters={"gain_error": (-0.48, 0.02)})
    tentative = effect("elastic_tether", "torso", 0.3) | {"told_as": "tentative"}
    beside = judged(PLATES_FAULT, answer(right, tentative))
    assert (beside.outcome, beside.tentative_count) == ("right", 1)
    assert judged(PLATES_FAULT, answer(right | {"told_as": "tentative"})).outcome == "tentative"
    assert judged(PLATES_FAULT, answer(right, tentative | {"told_as": "name"})).outcome == "right_but_more"


@pytest.mark.parametrize(("confidence", "sure"), [(0.98, True), (0.9, False)])
def test_wrong_and_very_sure(confidence, sure):
    verdict = judged(PLATES_FAULT, answer(effect("elastic_tether", "torso", confidence)))
    assert verdict.very_sure_and_wrong == sure


def test_no_answer_is_a_failure():
    assert judged(PLATES_FAULT, {"diagnosis": None, "seconds_cpu": 300.0}).outcome == "failed"


@pytest.mark.parametrize(
    ("effects", "verdict", "outcome"),
    [
        ([], "clean", "silent"),
        ([], "unexplained", "unexplained"),
        ([effect("drag", "torso", 0.6)], "explained", "tentative"),
        ([effect("drag", "torso", 0.95)], "explained", "alarm"),
    ],
)
def test_what_was_left_alone(effects, verdict, outcome):
    truth = {"case": "c", "kind": "clean", "plate": None, "markers": [], "times_s": None, "size": {}}
    assert judged(truth, answer(*effects, verdict=verdict)).outcome == outcome


@pytest.mark.parametrize(("frames", "outcome"), [(((0, 60),), "right"), (((60, 100),), "wrong")])
def test_a_step_has_a_time(frames, outcome):
    """Frames count from the trial's start, which is half a second on the recording's clock."""
    truth = PLATES_FAULT | {"kind": "lost_step", "size": {}, "times_s": [0.5, 1.1]}
    assert judged(truth, answer(effect("off_plate_step", "calcn_r", frames=frames))).outcome == outcome


def test_two_lags_told_as_one_are_a_class_and_told_as_one_where_they_are_one_are_right():
    truth = PLATES_FAULT | {"kind": "two_lags", "plate": None}
    one = answer(effect("clock_offset", "all", parameters={"offset_s": (0.012, 0.001)}))
    apart = {"offset_s a": 0.008, "offset_s b": 0.02}
    alike = {"offset_s a": 0.0115, "offset_s b": 0.012}
    assert judged(truth | {"size": apart}, one).outcome == "class"
    assert judged(truth | {"size": alike}, one).outcome == "right"


@pytest.mark.parametrize(("second", "outcome"), [(0.019, "right"), (0.009, "class")])
def test_two_lags_told_by_trial_are_right_where_each_is(second, outcome):
    truth = PLATES_FAULT | {
        "kind": "two_lags",
        "plate": None,
        "size": {"offset_s a": 0.008, "offset_s b": 0.02},
    }
    parameters = {"offset_s a": (0.0085, 0.001), "offset_s b": (second, 0.001)}
    each = answer(effect("trial_clocks", "each trial", parameters=parameters))
    assert judged(truth, each).outcome == outcome


@pytest.mark.parametrize(
    ("id", "target", "outcome"),
    [
        ("plate_clock", "plate_1", "right"),
        ("plate_clock", "plate_2", "wrong"),
        ("clock_offset", "all", "class"),
    ],
)
def test_the_clock_of_one_plate_has_a_place(id, target, outcome):
    truth = PLATES_FAULT | {"kind": "one_plate_late", "size": {"offset_s": 0.03}}
    said = answer(effect(id, target, parameters={"offset_s": (0.029, 0.001)}))
    assert judged(truth, said).outcome == outcome


@pytest.mark.parametrize(("plate", "outcome"), [(1, "right"), (2, "missed")])
def test_a_fault_that_reading_corrects_and_tells_counts_as_right(plate, outcome):
    truth = PLATES_FAULT | {"kind": "sign", "size": {"gain": -1.0}, "plate": plate}
    note = "trial_a: ground_force_1: forces point downwards, on the plate; their sign is turned: only so …"
    assert judged(truth, answer(verdict="clean", notes=[note])).outcome == outcome


def test_an_entered_mass_is_held_to_its_distance_from_one():
    truth = PLATES_FAULT | {"kind": "other_mass", "plate": None, "size": {"mass_factor": 0.8}}
    near = answer(effect("subject_mass", "all", parameters={"mass_factor": (0.83, 0.01)}))
    far = answer(effect("subject_mass", "all", parameters={"mass_factor": (0.95, 0.01)}))
    assert judged(truth, near).outcome == "right"
    assert judged(truth, far).outcome == "class"


@pytest.mark.parametrize(
    ("target", "verdict", "outcome"),
    [
        ("plate_1", "unexplained", "class"),
        ("plate_2", "unexplained", "unexplained"),
        ("plate_1", "clean", "missed"),  # whoever reads "clean" looks no further
    ],
)
def test_the_loudest_direct_check_tells_the_class_where_nothing_is_named(target, verdict, outcome):
    truth = PLATES_FAULT | {"kind": "turned_half", "size": {"yaw_deg": 180.0}}
    said = answer(verdict=verdict)
    turned = {
        "target": target,
        "speaks_for": ["plate_turned_or_mirrored"],
        "nats": {"plate_turned_or_mirrored": 20.0},
    }
    slipped = {"target": "a", "speaks_for": ["slip"], "nats": {"slip": 6.0}}
    said["diagnosis"]["direct_checks"] = [slipped, turned]
    assert judged(truth, said).outcome == outcome


@pytest.mark.parametrize(
    ("kind", "size", "id", "parameters", "outcome"),
    [
        ("turned_half", {"yaw_deg": 180.0}, "plate_turn", {"turn_deg": (-180.0, 0.0)}, "right"),
        ("turned_quarter", {"yaw_deg": 90.0}, "plate_turn", {"turn_deg": (-90.0, 0.0)}, "class"),
        ("mirrored", {"mirrored_axis": 2.0}, "plate_mirror", {"mirrored_axis_deg": (-90.0, 0.0)}, "right"),
        ("mirrored", {"mirrored_axis": 0.0}, "plate_mirror", {"mirrored_axis_deg": (90.0, 0.0)}, "class"),
        ("pounds", {"gain": 0.2248}, "plate_units", {"factor": (0.2248, 0.0)}, "right"),
        ("pounds", {"gain": 0.2248}, "plate_units", {"factor": (0.5, 0.0)}, "class"),
    ],
)
def test_a_choice_has_to_be_the_right_one(kind, size, id, parameters, outcome):
    truth = PLATES_FAULT | {"kind": kind, "size": size}
    assert judged(truth, answer(effect(id, parameters=parameters))).outcome == outcome
