"""The judge of gait events, by hand: what it takes for a step, and how it matches."""

import ezc3d
import numpy as np
import pytest

from benchmarks.gait_events import Told, judged, without_forces
from benchmarks.gait_plates import RECORDINGS, Load, Points, Recording, Step, steps_of

WALK = Recording("folder", "walk", "m.trc", "f.mot", ("R",), ("L",))


def points(seconds=4.0, rate=100.0):
    times = np.arange(round(seconds * rate)) / rate
    right, left = np.zeros((len(times), 3)), np.zeros((len(times), 3))
    right[:, 2], left[:, 2] = 0.1, -0.1
    return Points(times, {"R": right, "L": left, "hip": np.zeros_like(right)}, 0.0)


def load(knots, heights, side=0.1, level=0.0):
    times = np.arange(4000) / 1000
    vertical = level + np.interp(times, knots, heights)
    return Load(times, vertical, np.tile([0.0, 0.0, side], (len(times), 1)))


def test_a_ramp_is_crossed_between_samples_with_the_zero_level_off():
    """8 N a millisecond: 20 N after 2.5 ms; the plate reads 7 N too much throughout."""
    (step,) = steps_of(WALK, points(), [load([1.0, 1.1, 1.6, 1.7], [0, 800, 800, 0], level=7.0)])
    assert step.foot == "right"
    assert step.on_s == pytest.approx(1.0025, abs=1e-6)
    assert step.off_s == pytest.approx(1.6975, abs=1e-6)


def test_touches_and_knocks_are_no_steps_and_two_plates_under_one_foot_are_one():
    touch, knock = load([1, 1.1, 1.6, 1.7], [0, 100, 100, 0]), load([1, 1.01, 1.03, 1.04], [0, 900, 900, 0])
    assert steps_of(WALK, points(), [touch, knock]) == []
    first, second = load([1, 1.1, 1.3, 1.4], [0, 800, 800, 0]), load([1.3, 1.4, 1.7, 1.8], [0, 800, 800, 0])
    (step,) = steps_of(WALK, points(), [first, second])
    assert (step.on_s, step.off_s) == (pytest.approx(1.0025), pytest.approx(1.7975))


def test_each_event_is_matched_once_and_the_rest_is_missed_or_extra():
    steps = [Step("left", 1.0, 1.6), Step("right", 1.5, 2.2)]
    told = [
        Told("left", "contact", 1.02),
        Told("left", "contact", 1.04),
        Told("left", "foot-off", 1.9),
        Told("right", "contact", 1.49),
        Told("right", "foot-off", 2.2),
        Told("right", "contact", 3.5),
    ]
    verdict = judged(WALK, points(), steps, told)
    assert verdict.errors["contact"] == pytest.approx([-0.01, 0.02])
    assert verdict.missed == ["left foot-off at 1.60 s"]
    assert verdict.extra == ["left contact at 1.04 s"]  # 1.9 s and 3.5 s are off the plates: nobody knows
    assert not verdict.passes
    everywhere = Recording("folder", "walk", "m.trc", "f.mot", ("R",), ("L",), all_steps=True)
    assert len(judged(everywhere, points(), steps, told).extra) == 3


@pytest.mark.real
@pytest.mark.parametrize("name", ["opencap_subject6 walking1", "c3d_lab_trials/lasem_FAILT01 Walk01"])
def test_copies_hold_markers_and_nothing_of_forces(real_data, tmp_path, name):
    recording = next(one for one in RECORDINGS if one.name == name)
    if not (real_data / recording.folder).is_dir():
        pytest.skip(f"{recording.folder} is not there")
    without_forces(recording, tmp_path / "copy")
    assert "forces" not in (tmp_path / "copy" / "subject.toml").read_text()
    assert not list((tmp_path / "copy").rglob("*.mot"))
    for file in (tmp_path / "copy").glob("*.c3d"):
        content = ezc3d.c3d(str(file))
        assert content["data"]["points"].shape[2] > 0
        assert content["data"]["analogs"].size == 0
        assert "EVENT" not in content["parameters"]
        assert content["parameters"].get("FORCE_PLATFORM", {}).get("USED", {"value": [0]})["value"][0] == 0
