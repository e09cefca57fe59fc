"""Effects put into real recordings: their size, and what counts as recovered."""

import json
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.diagnosis import information
from benchmarks.diagnosis.information import FINDABLE_NATS, LARGEST, larger, write_findable_still
from benchmarks.diagnosis.judge import Verdict
from benchmarks.diagnosis.score import Scored, real
from solver.simulate.faults.cases import one_case
from solver.simulate.faults.worlds import plan_world


@pytest.mark.parametrize("nats", [-3.0, 0.0, 7.5, 29.9])
def test_a_size_that_says_too_little_grows_but_not_at_once(nats):
    grown = larger(1.0, nats)
    assert 1.1 <= grown <= 1.6


def test_information_grows_with_the_square_of_the_size():
    assert larger(1.0, FINDABLE_NATS / 1.5**2) == pytest.approx(1.5)


def test_what_would_have_to_be_huge_is_left_out():
    assert larger(LARGEST, 1.0) is None


@pytest.mark.parametrize(("activity", "least"), [("squat", (30 / 11) ** 0.5), ("walk", 1.0)])
def test_a_squats_effect_has_the_size_that_it_can_tell_and_a_walks_the_drawn_one(
    tmp_path, monkeypatch, activity, least
):
    """As if the reference size told eleven nats, others with the square; sizes grow by a tenth at least."""
    world = plan_world(np.random.default_rng(3), activity)
    plan = one_case("case_0001", ("plate_gain",), 3, world=replace(world, duration=1.0))

    def size(folder):
        truth = json.loads((folder.parents[1] / "truth" / f"{folder.name}.json").read_text())
        return truth["effects"][0]["size"]

    asked = []
    monkeypatch.setattr(
        information, "information", lambda own, other: asked.append(own) or 11 * size(other) ** 2
    )
    write_findable_still(tmp_path, plan)
    assert least <= size(tmp_path / "subjects" / "case_0001") <= 1.1 * least
    assert (tmp_path / "subjects" / "case_0001").is_dir()
    assert bool(asked) == (activity == "squat")


@pytest.mark.parametrize(("of_second", "there"), [(11, True), (0, False)])
def test_of_two_effects_in_a_squat_each_has_a_size_that_it_can_tell_alone(
    tmp_path, monkeypatch, of_second, there
):
    """As if the reference size of the first told forty nats."""
    world = plan_world(np.random.default_rng(3), "squat")
    plan = one_case("case_0001", ("gravity_tilt", "plate_gain"), 3, world=replace(world, duration=1.0))

    def told(own, other):
        (effect,) = json.loads((other.parents[1] / "truth" / f"{other.name}.json").read_text())["effects"]
        return 40.0 if effect["id"] == "gravity_tilt" else of_second * effect["size"] ** 2

    monkeypatch.setattr(information, "information", told)
    write_findable_still(tmp_path, plan)
    assert (tmp_path / "subjects" / "case_0001").is_dir() == there
    if there:
        truth = json.loads((tmp_path / "truth" / "case_0001.json").read_text())
        first, second = (effect["size"] for effect in truth["effects"])
        assert first == 1.0
        assert (30 / 11) ** 0.5 <= second <= 1.1 * (30 / 11) ** 0.5


def test_a_case_without_a_place_is_left_out(tmp_path):
    """A squat on two plates has no whole stance that could be missed."""
    world = plan_world(np.random.default_rng(3), "squat")
    plan = one_case("case_0001", ("off_plate_step",), 3, world=replace(world, duration=1.0))
    write_findable_still(tmp_path, plan)
    assert not list(tmp_path.iterdir())


def clock(found_s, untouched):
    hidden = {
        "id": "clock_offset",
        "target": "all",
        "parameters": {"offset_s": 0.020},
        "size": 2.5,
        "same_as": [],
        "frames": [],
    }
    effect = {"id": "clock_offset", "target": "all", "frames": []}
    effect["parameters"] = {"offset_s": {"value": found_s, "std": 0.001}}
    truth = {"case": "real_0001", "kind": "real", "effects": [hidden], "baseline": "walks__walk"}
    answer = {"diagnosis": {"verdict": "explained", "effects": [effect]}, "error": "", "seconds_cpu": 1.0}
    return Scored(truth, answer, Verdict("real_0001", "real", "right", ("clock_offset",)), untouched)


@pytest.mark.parametrize(
    ("found_s", "untouched", "recovered"),
    [
        (0.021, {}, True),
        (0.027, {}, False),
        (0.027, {"offset_s": 0.006}, True),
        (0.021, {"offset_s": 0.006}, False),
    ],
)
def test_the_injected_difference_is_counted_from_the_untouched_recording(found_s, untouched, recovered):
    said = real([clock(found_s, untouched)])
    assert f"parameters within 20 %: {'100' if recovered else '0'} %" in said


@pytest.mark.parametrize(
    ("own_s", "left_out"), [(-0.018, True), (-0.015, True), (-0.013, False), (0.01, False)]
)
def test_what_undoes_a_fault_that_was_there_is_listed_and_left_out(own_s, left_out):
    """Of 20 ms, less than 6 are left."""
    said = real([clock(0.027, {"offset_s": 0.006}), clock(0.020 + own_s, {"offset_s": own_s})])
    assert f"has of its own: {int(left_out)}" in said
    assert f"Named: 100 % [{'21' if left_out else '34'}, 100]" in said
    assert ("left out |" in said) is left_out
