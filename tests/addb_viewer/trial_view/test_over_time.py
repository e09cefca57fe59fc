"""Chosen quantities over time."""

from dataclasses import replace

import numpy as np
import pytest

from addb_viewer.trial_view.over_time import AT_FIRST, charts_json, choices_json
from addb_viewer.trial_view.trial_curves import TrialCurves
from tests.made_std import made_std


def test_what_is_listed_can_be_charted_and_nothing_else(make_replay):
    replay = make_replay()
    listed = [choice["id"] for choice in choices_json(replay)]
    assert listed[:2] == ["marker error", "vertical force"]
    assert set(AT_FIRST) <= set(listed)
    assert [chart["id"] for chart in charts_json(replay, None, (), (*listed, "nobody's angle"))] == listed
    assert choices_json(make_replay(fitted=False, plates=0)) == []


def test_a_chart_has_both_sides_gaps_and_shades_what_does_not_count(make_replay):
    replay = make_replay()
    replay.joints.torque[5] = np.nan
    (chart,) = charts_json(replay, None, (), ("knee_angle torque",))
    assert (chart["title"], chart["unit"], chart["shaded"]) == ("Knee flexion torque", "N·m", [[0, 20]])
    right, left = chart["lines"]
    assert (right["label"], left["label"]) == ("right", "left")
    assert right["values"][5] is left["values"][5] is None
    for line, values in ((right, replay.joints.torque[:, 1]), (left, replay.joints.torque[:, 2])):
        drawn = np.array(line["values"], dtype=float)
        np.testing.assert_allclose(drawn, values, atol=0.006)
        assert chart["low"] < np.nanmin(values) < np.nanmax(values) < chart["high"]


def test_a_band_of_95_per_cent_lies_behind_the_trials_own_lines_and_the_axis_holds_it(make_replay):
    replay = make_replay()
    banded = replace(replay, joints=replace(replay.joints, std=made_std(200, 3)))
    banded.joints.std.torque[:] *= 500  # 20 N·m
    torque, angle = charts_json(banded, banded, (), ("knee_angle torque", "knee_angle angle"))
    before, _, right, _ = torque["lines"]
    assert (before["band"], right["band"][:2]) == (None, [None, 39.2])
    np.testing.assert_allclose(angle["lines"][-1]["band"], np.degrees(0.0196), atol=0.006)
    assert torque["band"].endswith("none where a force was predicted, not measured")
    assert angle["band"].endswith("about the trial's mean")
    assert torque["high"] > max(right["values"]) + 39.2
    plain = charts_json(replay, None, (), ("knee_angle torque",))[0]
    assert (plain["band"], plain["lines"][0]["band"]) == ("", None)
    banded.joints.std.torque[50:60] *= 100  # a band that runs off stretches the axis by its half at most
    (wide,) = charts_json(banded, None, (), ("knee_angle torque",))
    assert wide["high"] == pytest.approx(40 + 0.5 * 80 + 0.06 * 160, rel=0.01)


def test_a_peak_beyond_the_axis_is_marked_with_its_size(make_replay):
    replay = make_replay()
    replay.markers.measured[77, 1] += 3.0  # [m]
    (chart,) = charts_json(replay, None, (), ("marker error",))
    ((frame, value, _),) = chart["peaks"]
    assert frame == 77
    assert value > 280  # [cm]
    assert chart["high"] < value
    assert [line["style"] for line in chart["lines"]] == ["", "", "bound"]


def test_the_solve_that_is_compared_with_and_other_trials_lie_behind(make_replay):
    replay = make_replay()
    moved = replace(replay, joints=replace(replay.joints, position=replay.joints.position + 0.1))
    far = replace(replay.joints, position=replay.joints.position[:100] * 3)
    run = TrialCurves("run", 50.0, np.arange(100) / 50.0, far, np.ones(100, dtype=bool))
    chart = charts_json(replay, moved, [run], ("knee_angle angle",))[0]
    assert [(line["style"], line["trial"], line["label"]) for line in chart["lines"]] == [
        ("trial", "run", "right"), ("trial", "run", "left"),
        ("before", "", "before"), ("before", "", "before"), ("", "", "right"), ("", "", "left"),
    ]  # fmt: skip
    overlaid, _, before, _, own, _ = chart["lines"]
    assert overlaid["step"] == 2.0  # frames of this trial
    assert len(overlaid["values"]) == 100
    assert overlaid["color"] == before["color"] == own["color"]
    np.testing.assert_allclose(np.subtract(before["values"], own["values"]), np.degrees(0.1), atol=0.011)
    assert chart["high"] >= max(overlaid["values"])


def test_torques_that_rest_on_no_force_are_called_predicted(make_replay):
    replay = make_replay()
    replay = replace(replay, joints=replace(replay.joints, predicted=True), residual=None)
    drawn = charts_json(replay, None, (), ("knee_angle torque", "knee_angle angle"))
    assert [chart["title"] for chart in drawn] == ["Predicted knee flexion torque", "Knee flexion angle"]
    assert drawn[0]["shaded"] == []
